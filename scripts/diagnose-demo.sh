#!/usr/bin/env bash
# The diagnosis on the paper's own case: a plant file with viscous friction only, against runs of a (simulated) rig that has
# stick-slip. Builds if it must, makes six runs of 8 s in virtual time, and lets `upright diagnose` find what is missing.
#   scripts/diagnose-demo.sh [FOLDER]      FOLDER is a new temporary one when none is named
set -euo pipefail
cd "$(dirname "$0")/.."

upright=$(scripts/program.sh)
folder=${1:-$(mktemp -d)}

# Gains, starting angle in degrees, delay in seconds: delays make the cart move far enough to show how friction slides.
number=0
while read -r gains theta0_deg delay_s; do
  number=$((number + 1))
  "$upright" run --rig config/rigs/simulated.yaml --gains "config/gains/$gains.yaml" --fast --seed "$number" \
    --theta0-deg "$theta0_deg" --delay "$delay_s" --duration 8 --label "demo$number" --out "$folder/runs" >/dev/null
done <<'RUNS'
viscous 6 0
exponential 5 0.018
exponential 6 0.021
viscous 4 0.012
exponential 3 0.019
viscous 5 0.02
RUNS

"$upright" diagnose --model config/plants/viscous.yaml --data "$folder"/runs/*/ --out "$folder/diagnosis"
"$upright" report "$folder/diagnosis"
