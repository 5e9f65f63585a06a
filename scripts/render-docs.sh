#!/usr/bin/env bash
# Renders docs/ into build/docs as web pages that need no server and no network. The first call installs mkdocs-material
# from PyPI into a virtual environment in build/. A broken link is an error. The exit code is 77 if PyPI cannot be
# reached.
#   scripts/render-docs.sh           renders the pages
#   scripts/render-docs.sh --serve   serves them at http://127.0.0.1:8000 and renders again after each change
set -euo pipefail
cd "$(dirname "$0")/.."

venv=build/docs-venv
version=9.8.1
if ! "$venv/bin/pip" show mkdocs-material 2>/dev/null | grep -qx "Version: $version"; then
  python3 -m venv "$venv" || { echo "no virtual environment can be created: install python3-venv" >&2; exit 1; }
  "$venv/bin/pip" install --quiet --disable-pip-version-check "mkdocs-material==$version" ||
    { echo "mkdocs-material cannot be installed: connect this machine to PyPI" >&2; exit 77; }
fi

case "${1:-}" in
  '') NO_MKDOCS_2_WARNING=1 "$venv/bin/mkdocs" build --quiet --strict && echo "build/docs/index.html" ;;
  --serve) "$venv/bin/mkdocs" serve --dev-addr 127.0.0.1:8000 ;;
  *) echo "usage: scripts/render-docs.sh [--serve]" >&2; exit 2 ;;
esac
