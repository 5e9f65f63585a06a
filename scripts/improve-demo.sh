#!/usr/bin/env bash
# Demonstrates how a diagnosis improves control. The simulated rig has stick-slip friction and an actuator delay of 8
# ms; the first plant file has neither. Takes about a minute in virtual time. Builds the program if necessary.
#   scripts/improve-demo.sh [FOLDER]      FOLDER keeps the results (default: a new temporary folder)
set -euo pipefail
cd "$(dirname "$0")/.."

upright=${UPRIGHT:-$(scripts/program.sh)}
folder=${1:-$(mktemp -d)}
mkdir -p "$folder"
say() { printf '\n== %s\n' "$*"; }

# The rig. Only the simulation reads its plant file; the commands below get first.yaml or the diagnosed model.
cp config/plants/viscous.yaml "$folder/first.yaml"
{ cat config/plants/exponential.yaml && echo "    - {kind: input_delay, delay_s: 0.008}"; } >"$folder/rig-plant.yaml"
sed 's#\.\./plants/exponential\.yaml#rig-plant.yaml#' config/rigs/simulated.yaml >"$folder/rig.yaml"

# balance GAINS DEGREES DELAY SECONDS LABEL: a run in virtual time; prints its run directory.
balance() {
  "$upright" run --rig "$folder/rig.yaml" --gains "$1" --fast --theta0-deg "$2" --delay "$3" --duration "$4" \
    --label "$5" --out "$folder/runs" >"$folder/run.out" 2>"$folder/run.err" || [ $? -eq 3 ] || { cat "$folder/run.err" >&2; return 1; }
  tail -n 1 "$folder/run.out"
}

say "1. Design gains from the first plant file, which has viscous friction only."
"$upright" design "$folder/first.yaml" --out "$folder/first-gains.yaml" --force | tail -n 1

say "2. Balance the rig with these gains for 30 s (before)."
before=$(balance "$folder/first-gains.yaml" 3 0 30 before)
echo "$before"

say "3. Record three short runs with larger initial angles and some delay, which excite the friction."
data=()
for start in "6 0" "5 0.010" "4 0.015"; do
  read -r degrees delay_s <<<"$start"
  data+=("$(balance "$folder/first-gains.yaml" "$degrees" "$delay_s" 4 "data${#data[@]}")")
done
printf '%s\n' "${data[@]}"

say "4. Diagnose which effects the first plant file lacks, and write model.yaml with them."
"$upright" diagnose --model "$folder/first.yaml" --data "${data[@]}" --out "$folder/diagnosis"

say "5. Design controllers from model.yaml, with a Kalman filter and with an extended Kalman filter that uses the
   friction, and for comparison one from the first plant file with a Kalman filter."
design() { # PLANT ESTIMATOR FILE
  "$upright" design "$folder/$1" --estimator "$2" --out "$folder/$3.yaml" --force | sed -n "s/^estimator: /$3: /p"
}
design diagnosis/model.yaml kalman model-quiet
design diagnosis/model.yaml extended_kalman model-friction
design first.yaml kalman first-quiet

say "6. Balance the rig with each of them for 30 s from the same initial state."
after=$(balance "$folder/model-quiet.yaml" 3 0 30 after)
friction=$(balance "$folder/model-friction.yaml" 3 0 30 friction)
unaware=$(balance "$folder/first-quiet.yaml" 3 0 30 unaware)
printf '%s\n' "$after" "$friction" "$unaware"

say "7. Compare: A before; B model.yaml, Kalman filter; C model.yaml, extended Kalman filter;
   D first plant file, Kalman filter."
"$upright" compare "$before" "$after" --out "$folder/report.html" >/dev/null
"$upright" compare "$before" "$after" "$friction" "$unaware" --out "$folder/all.html" | grep -v '^Written'
echo
echo "before and after in one plot: $folder/report.html"
echo "all four runs: $folder/all.html"
