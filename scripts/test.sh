#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test. Needs git and apt, nothing else.
#   scripts/test.sh [PRESET] [ctest arguments]      PRESET is release when none is named
set -euo pipefail
cd "$(dirname "$0")/.."

preset=${1:-release}
shift || true
scripts/install-deps.sh --test
scripts/build.sh "$preset"
ctest --preset "$preset" "$@"
