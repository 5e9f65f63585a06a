#!/usr/bin/env bash
# Installs missing packages, builds, and runs every test. Reports retried and skipped tests, and fails if they exceed
# the budget in scripts/count_retries.py. Requires only git and apt.
#   scripts/test.sh [PRESET] [ctest arguments]      default: release
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
