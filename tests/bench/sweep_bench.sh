#!/usr/bin/env bash
# The sweep engine beside the event engine, Boost odeint, numba and scipy, on this machine, in one run.
#   tests/bench/sweep_bench.sh       makes a virtual environment in build/bench-venv the first time
set -euo pipefail
cd "$(dirname "$0")/../.."

scripts/build.sh bench sweep_bench
venv=build/bench-venv
[ -x $venv/bin/python ] || python3 -m venv $venv
$venv/bin/python -c 'import numba, scipy' 2>/dev/null || $venv/bin/pip install --quiet numba scipy
log=$(mktemp)
trap 'rm -f "$log"' EXIT
build/bench/tests/bench/sweep_bench | tee "$log" | grep -v '_MS '
$venv/bin/python tests/bench/sweep_bench.py "$(sed -n 's/^LANES_MS //p' "$log")" "$(sed -n 's/^RIG_MS //p' "$log")"
