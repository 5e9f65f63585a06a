#!/usr/bin/env bash
# Diagnoses measurements of other laboratories: writes a dataset file and a plant file for each, runs `upright diagnose`
# and `upright report`, and prints a table of the results (docs/results/real-data.md has such a table).
#   scripts/real-data.sh DATA [OUT] [NAME...]    DATA contains the folders emps, aau, uw and canterbury, which are not
#                                                part of this repository; OUT keeps the results (default: a new temporary
#                                                folder); NAMEs (as in the table) select some of the diagnoses
# Diagnoses that OUT already contains are not repeated. The exit code is 1 if one was refused.
set -euo pipefail
data=$(realpath "${1:?the first argument is missing: name the folder that contains emps, aau, uw and canterbury}")
cd "$(dirname "$0")/.."

upright=$(scripts/program.sh)
out=${2:-$(mktemp -d)}
shift "$(($# > 1 ? 2 : 1))"

refused=0
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
    refused=1
  fi
  echo "$(($(date +%s) - start))" >"$folder/seconds.txt"
done
python3 scripts/real_data.py table "$out"
exit "$refused"
