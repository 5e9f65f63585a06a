#!/usr/bin/env bash
# Makes a virtual environment for tests: make_venv.sh FOLDER MODULES PACKAGE...
# MODULES are those that tests import ("pymodbus, serial"), each PACKAGE is what provides them. Where PyPI cannot be
# reached the tests that need it are skipped (exit code 77), and say so.
set -eu
folder=$1 modules=$2
shift 2
[ -x "$folder/bin/python" ] && "$folder/bin/python" -c "import $modules" 2>/dev/null && exit 0
rm -rf "$folder"
python3 -m venv "$folder" || { echo "install python3-venv: no virtual environment can be made" >&2; exit 1; }
"$folder/bin/pip" install --quiet --disable-pip-version-check --retries 5 "$@" ||
  { echo "give this machine a way to PyPI: $* cannot be installed, its tests are skipped" >&2; exit 77; }
