#!/usr/bin/env bash
# From a measurement to a better rig, on a simulated one: its friction sticks and slips and its actuator is 8 ms late, and
# the first plant file knows neither. Takes about a minute, in virtual time; builds if it must.
#   scripts/improve-demo.sh [FOLDER]      FOLDER is a new temporary one when none is named
set -euo pipefail
cd "$(dirname "$0")/.."

upright=${UPRIGHT:-$(scripts/program.sh)}
folder=${1:-$(mktemp -d)}
mkdir -p "$folder"
say() { printf '\n== %s\n' "$*"; }

# The rig. Only the simulation reads its plant; every command below gets first.yaml, or what was found.
cp config/plants/viscous.yaml "$folder/first.yaml"
{ cat config/plants/exponential.yaml && echo "    - {kind: input_delay, delay_s: 0.008}"; } >"$folder/rig-plant.yaml"
sed 's#\.\./plants/exponential\.yaml#rig-plant.yaml#' config/rigs/simulated.yaml >"$folder/rig.yaml"

# balance GAINS DEGREES DELAY SECONDS LABEL: a run in virtual time; prints its folder.
balance() {
  "$upright" run --rig "$folder/rig.yaml" --gains "$1" --fast --theta0-deg "$2" --delay "$3" --duration "$4" \
    --label "$5" --out "$folder/runs" >"$folder/run.out" 2>"$folder/run.err" || [ $? -eq 3 ] || { cat "$folder/run.err" >&2; return 1; }
  tail -n 1 "$folder/run.out"
}

say "1. Gains are designed from the first plant file, which has viscous friction only."
"$upright" design "$folder/first.yaml" --out "$folder/first-gains.yaml" --force | tail -n 1

say "2. They balance the rig for 30 s: this is the rig before."
before=$(balance "$folder/first-gains.yaml" 3 0 30 before)
echo "$before"

say "3. Three short runs from larger angles and with some delay make the cart move, so that the friction shows."
data=()
for start in "6 0" "5 0.010" "4 0.015"; do
  read -r degrees delay_s <<<"$start"
  data+=("$(balance "$folder/first-gains.yaml" "$degrees" "$delay_s" 4 "data${#data[@]}")")
done
printf '%s\n' "${data[@]}"

say "4. The diagnosis says what the first plant file lacks, and writes model.yaml, which has it."
"$upright" diagnose --model "$folder/first.yaml" --data "${data[@]}" --out "$folder/diagnosis"

say "5. Controllers are designed from model.yaml: a Kalman filter, and an extended one, which uses the friction found; and
   the Kalman filter from the first plant file, to see what model.yaml is good for."
design() { # PLANT ESTIMATOR FILE
  "$upright" design "$folder/$1" --estimator "$2" --out "$folder/$3.yaml" --force | sed -n "s/^estimator: /$3: /p"
}
design diagnosis/model.yaml kalman model-quiet
design diagnosis/model.yaml extended_kalman model-friction
design first.yaml kalman first-quiet

say "6. Each balances the rig for 30 s from the same start."
after=$(balance "$folder/model-quiet.yaml" 3 0 30 after)
friction=$(balance "$folder/model-friction.yaml" 3 0 30 friction)
unaware=$(balance "$folder/first-quiet.yaml" 3 0 30 unaware)
printf '%s\n' "$after" "$friction" "$unaware"

say "7. What changed: A is before, B the Kalman filter and C the extended one of model.yaml, D that of the first plant file."
"$upright" compare "$before" "$after" --out "$folder/report.html" >/dev/null
"$upright" compare "$before" "$after" "$friction" "$unaware" --out "$folder/all.html" | grep -v '^Written'
echo
echo "before and after over each other: $folder/report.html"
echo "all of them: $folder/all.html"
