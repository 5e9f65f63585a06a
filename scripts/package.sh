#!/usr/bin/env bash
# Builds the Debian package into build/package and prints its path.
#   scripts/package.sh
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-deps.sh --package >&2
scripts/build.sh package >&2
rm -f build/package/upright_*.deb
(cd build/package && cpack) >build/package/cpack.log 2>&1 || { tail -n 30 build/package/cpack.log >&2; exit 1; }
ls "$PWD"/build/package/upright_*.deb
