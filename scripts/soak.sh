#!/usr/bin/env bash
# Runs the controller for a long time and checks that there is no memory leak, no clock drift and no lost row, that the
# log replays bit for bit, and that a report can be made.
#   scripts/soak.sh [--virtual-hours 2] [--real-minutes 10] [further options of scripts/soak.py, see its --help]
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/program.sh >/dev/null
exec python3 scripts/soak.py "$@"
