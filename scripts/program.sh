#!/usr/bin/env bash
# Prints where the program is; builds it first where it is not there yet.
set -euo pipefail
cd "$(dirname "$0")/.."

upright=build/release/src/cli/upright
if [ ! -x "$upright" ]; then
  scripts/install-deps.sh >&2
  scripts/build.sh release upright >&2
fi
echo "$upright"
