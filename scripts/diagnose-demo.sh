#!/usr/bin/env bash
# Demonstrates the diagnosis with the paper's case: the plant file has viscous friction only, and the simulated rig has
# stick-slip. Builds the program if necessary, makes six runs of 8 s in virtual time, and runs `upright diagnose`.
#   scripts/diagnose-demo.sh [FOLDER]      FOLDER keeps the results (default: a new temporary folder)
set -euo pipefail
cd "$(dirname "$0")/.."

upright=$(scripts/program.sh)
folder=${1:-$(mktemp -d)}

# Gains, initial angle in degrees, delay in seconds. The delays increase the cart's motion, which excites the friction.
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
