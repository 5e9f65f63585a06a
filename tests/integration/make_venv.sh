#!/usr/bin/env bash
# Makes the virtual environment with pymodbus for the tests, in the folder given. Fails where PyPI cannot be reached.
set -eu
folder=$1
[ -x "$folder/bin/python" ] && "$folder/bin/python" -c 'import pymodbus' 2>/dev/null && exit 0
rm -rf "$folder"
python3 -m venv "$folder" || { echo "install python3-venv: no virtual environment can be made" >&2; exit 1; }
"$folder/bin/pip" install --quiet --disable-pip-version-check 'pymodbus==3.6.9' ||
  { echo "give this machine a way to PyPI: pymodbus cannot be installed" >&2; exit 1; }
