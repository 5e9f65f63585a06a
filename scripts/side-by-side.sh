#!/usr/bin/env bash
# Other methods beside `upright diagnose` on the same files, scored on runs that none of them saw: regression, PySINDy and
# a fixed structure fitted by Ceres. docs/results/comparison.md has the tables that it prints.
#   scripts/side-by-side.sh DATA [OUT] [CASE...]    DATA contains the folders emps and aau, which are not part of this
#                                                   repository; OUT keeps the results (default: a new temporary folder);
#                                                   CASEs (emps, aau-cart, coulomb_friction, quadratic_drag, motor_lag)
#                                                   select some; --without-sindy leaves out the method that takes minutes
# Diagnoses that OUT already contains are not repeated.
set -euo pipefail
data=$(realpath "${1:?the first argument is missing: name the folder that contains emps and aau}")
out=$(realpath -m "${2:-$(mktemp -d)}")
shift "$(($# > 1 ? 2 : 1))"
cd "$(dirname "$0")/.."

python=$(scripts/comparison-python.sh)
build=${UPRIGHT_BUILD:-build/release}
[ -n "${UPRIGHT_BUILD:-}" ] || scripts/build.sh release upright grey_box_fit diagnosis_matrix >&2
"$python" studies/comparison/side_by_side.py "$build" "$data" "$out" "$@"
