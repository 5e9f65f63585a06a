#!/usr/bin/env bash
# Prints the path of the Python of studies/comparison. Makes its virtual environment first if it does not exist.
set -euo pipefail
cd "$(dirname "$0")/.."

venv=${UPRIGHT_COMPARISON_VENV:-$PWD/build/comparison-venv}
tests/integration/make_venv.sh "$venv" "numpy, scipy, yaml, pysindy" -r studies/comparison/requirements.txt >&2
echo "$venv/bin/python"
