#!/usr/bin/env bash
# Makes the virtual environment with pymodbus for the tests, in the folder given. Where PyPI cannot be reached the tests
# that need it are skipped (exit code 77), and say so.
set -eu
folder=$1
[ -x "$folder/bin/python" ] && "$folder/bin/python" -c 'import pymodbus, serial' 2>/dev/null && exit 0
rm -rf "$folder"
python3 -m venv "$folder" || { echo "install python3-venv: no virtual environment can be made" >&2; exit 1; }
"$folder/bin/pip" install --quiet --disable-pip-version-check --retries 5 'pymodbus==3.6.9' 'pyserial==3.5' ||
  { echo "give this machine a way to PyPI: pymodbus cannot be installed, its tests are skipped" >&2; exit 77; }
