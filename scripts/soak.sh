#!/usr/bin/env bash
# A long run and what it must leave behind: no leak, no drift of the clock, no row lost, a replay to the bit and a report.
#   scripts/soak.sh [--virtual-hours 2] [--real-minutes 10] [further options of scripts/soak.py, see its --help]
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/program.sh >/dev/null
exec python3 scripts/soak.py "$@"
