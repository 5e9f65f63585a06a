#!/usr/bin/env bash
# Prints the path of the program. Builds the program first if it does not exist.
set -euo pipefail
cd "$(dirname "$0")/.."

upright=build/release/src/cli/upright
if [ ! -x "$upright" ]; then
  scripts/install-deps.sh >&2
  scripts/build.sh release upright >&2
fi
echo "$upright"
