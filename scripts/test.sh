#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test; says what was tried again and what was skipped, and fails above the
# budget for that (scripts/count_retries.py). Needs git and apt, nothing else.
#   scripts/test.sh [PRESET] [ctest arguments]      PRESET is release when none is named
set -euo pipefail
cd "$(dirname "$0")/.."

preset=${1:-release}
shift || true
scripts/install-deps.sh --test
scripts/build.sh "$preset"
build=$PWD/build/$preset
rm -f "$build/retries_and_skips.log"
status=0
ctest --preset "$preset" --output-junit "$build/ctest.xml" --test-output-size-passed 1000000 "$@" || status=$?
scripts/count_retries.py "$build" || status=$?
exit "$status"
