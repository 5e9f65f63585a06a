#!/usr/bin/env bash
# Writes the reference of the library into build/api/html, from the comments of include/upright. Fails where a symbol has no
# comment.
#   scripts/api-reference.sh
set -euo pipefail
cd "$(dirname "$0")/.."

command -v doxygen >/dev/null || { echo "doxygen is not installed: run scripts/install-deps.sh --dev" >&2; exit 2; }
rm -rf build/api
mkdir -p build
doxygen docs/Doxyfile
