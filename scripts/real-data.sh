#!/usr/bin/env bash
# Measurements of other laboratories, diagnosed: writes a dataset and a plant file for each, lets `upright diagnose` and
# `upright report` run, and prints the table of what was found (docs/results/real-data.md holds a measured one).
#   scripts/real-data.sh DATA [OUT] [NAME...]    DATA holds the folders emps, aau, uw and canterbury, which are not part of
#                                                this repository; OUT is a new temporary folder when none is named; NAMEs
#                                                (as in the table) choose some of the diagnoses
# What is in OUT already is not diagnosed again.
set -euo pipefail
data=$(realpath "${1:?name the folder that holds emps, aau, uw and canterbury}")
cd "$(dirname "$0")/.."

upright=$(scripts/program.sh)
out=${2:-$(mktemp -d)}
shift "$(($# > 1 ? 2 : 1))"

python3 scripts/real_data.py prepare "$data" "$out"
for folder in "$out"/*/; do
  name=$(basename "$folder")
  if [ $# -gt 0 ] && ! [[ " $* " == *" $name "* ]]; then continue; fi
  if [ -e "$folder/diagnosis/diagnosis.json" ]; then continue; fi
  rm -rf "$folder/diagnosis"
  echo "$name" >&2
  start=$(date +%s)
  if "$upright" diagnose --model "$folder/plant.yaml" --data "$folder"/data*.yaml --out "$folder/diagnosis" \
    >"$folder/diagnose.txt" 2>"$folder/problem.txt"; then
    "$upright" report "$folder/diagnosis" >/dev/null
  else
    cat "$folder/problem.txt" >&2
  fi
  echo "$(($(date +%s) - start))" >"$folder/seconds.txt"
done
python3 scripts/real_data.py table "$out"
