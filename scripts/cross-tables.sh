#!/usr/bin/env bash
# Cross tables of measurements of other laboratories: models from each run of a rig (by `upright diagnose` and by a plain
# regression) scored on each other run of that rig. docs/results/real-data.md has such tables.
#   scripts/cross-tables.sh DATA [OUT] [RIG...]    DATA contains the folders emps, aau, uw and canterbury, which are not
#                                                  part of this repository; OUT keeps the results (default: a new temporary
#                                                  folder); RIGs (emps, aau-cart, aau-pendulum, uw, canterbury) select some
# Diagnoses that OUT already contains are not repeated.
set -euo pipefail
data=$(realpath "${1:?the first argument is missing: name the folder that contains emps, aau, uw and canterbury}")
out=$(realpath -m "${2:-$(mktemp -d)}")
shift "$(($# > 1 ? 2 : 1))"
cd "$(dirname "$0")/.."

python=$(scripts/comparison-python.sh)
upright=${UPRIGHT:-$(scripts/program.sh)}
"$python" studies/comparison/cross_tables.py "$upright" "$data" "$out" "$@"
