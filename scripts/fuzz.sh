#!/usr/bin/env bash
# Fuzzes the file readers. The corpus starts with the example files of the repository.
#   scripts/fuzz.sh [SECONDS]       default: 60
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=${1:-60}
scripts/install-deps.sh --dev
scripts/build.sh fuzz reader_fuzz

corpus=$(mktemp -d)
trap 'rm -rf "$corpus"' EXIT
number=0
for file in config/*/*.yaml config/experiments/*/*.yaml tests/acceptance/malformed/*/*.yaml; do
  [ -e "$file" ] || continue
  number=$((number + 1))
  cp "$file" "$corpus/$number"
done
# A table of measured data with enough rows for the data checks, and a dataset file for it.
awk 'BEGIN { print "time_s,voltage_v,cart_m,theta_rad"
  for (k = 0; k < 170; k++) printf "%.2f,%.1f,%.4f,%.3f\n", k / 100, cos(k / 8), -cos(k / 8) / 20, 3.14 + sin(k / 9) }' \
  >"$corpus/table"
cat >"$corpus/dataset" <<'YAML'
dataset:
  file: measured.csv
  header: false
  delimiter: semicolon
  decimal: comma
  missing: gap
  cart_locked: false
  from_s: 1.0
  to_s: 9.0
  resolution: {cart_m: 1.0e-5, theta_rad: 0.0015}
  columns:
    time_s: {column: 1, scale: 0.001, period_s: 0.002}
    voltage_v: {column: 2, delay_s: 0.02}
    cart_m: {column: "x [mm]", scale: 0.001, offset: -0.1}
    theta_rad: {column: 4, scale: 0.0175, offset: 3.14, folded_every_rad: 3.14, mirrored: true}
YAML
mkdir -p build/fuzz/found
build/fuzz/tests/fuzz/reader_fuzz -max_total_time="$seconds" -max_len=4096 -timeout=10 -rss_limit_mb=2048 \
  -dict=tests/fuzz/reader.dict -artifact_prefix=build/fuzz/found/ -print_final_stats=1 "$corpus"
