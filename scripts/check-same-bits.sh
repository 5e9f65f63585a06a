#!/usr/bin/env bash
# Checks that results do not depend on the processor. Builds the program for x86-64, x86-64-v3 (AVX2) and x86-64-v4
# (AVX-512) and compares byte for byte: logs of `run --fast`, each log replayed by the other builds, and docs/paper.md
# with its figures. A build that this processor cannot run is reported and not compared.
#   scripts/check-same-bits.sh [FOLDER]     FOLDER keeps the results, FOLDER-ARCH the builds (default: build/same-bits)
# UPRIGHT_SKIP_PAPER=1 skips the paper, which takes most of the time.
set -euo pipefail
cd "$(dirname "$0")/.."

folder=${1:-build/same-bits}
mkdir -p "$folder/results"
folder=$(realpath "$folder")
programs=()
# The builds are as deep as build/ci: ccache then has most of their objects from it.
for arch in x86-64 x86-64-v3 x86-64-v4; do
  cmake --preset ci -B "$folder-$arch" -DUPRIGHT_WIDE_ARCH=$arch -DBUILD_TESTING=OFF \
    -DCMAKE_CXX_COMPILER_LAUNCHER="$(command -v ccache || true)" >/dev/null
  CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1 cmake --build "$folder-$arch" --target upright -- -v >"$folder-$arch.log" ||
    { tail -n 30 "$folder-$arch.log" >&2; exit 1; }
  if /lib64/ld-linux-x86-64.so.2 --help | grep -q "^  $arch (supported" || [ "$arch" = x86-64 ]; then
    programs+=("$arch")
  else
    echo "!! NOT COMPARED: this processor cannot run $arch"
  fi
done

# Makes libm behave as on a processor without fused multiply-add.
older="glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA,-FMA4,-AVX"
rm -rf "$folder/results"
# run ARCH LABEL ENVIRONMENT: a log for each gain file, with each plant.
run() {
  local out plant gain
  for plant in viscous exponential dynamic; do
    sed -e "s,\.\./plants/exponential,$PWD/config/plants/$plant," \
      -e "s,noise: {cart_m: 0.0,noise: {cart_m: 1.0e-5," config/rigs/simulated.yaml >"$folder/rig-$plant.yaml"
    for gain in config/gains/*.yaml; do
      out=$folder/results/$2/$plant-$(basename "$gain" .yaml)
      # A run that falls also has a log (exit code 3).
      env $3 "$folder-$1/src/cli/upright" run --fast --duration 20 --theta0-deg 2 --seed 5 --rig "$folder/rig-$plant.yaml" \
        --gains "$gain" --out "$out" >/dev/null || [ $? = 3 ]
    done
  done
}
different=0
for arch in "${programs[@]}"; do run "$arch" "$arch" UPRIGHT_SAME=1; done
run "${programs[-1]}" older-libm GLIBC_TUNABLES=$older
first=${programs[0]}
for other in "${programs[@]:1}" older-libm; do
  for run in "$folder/results/$first"/*; do
    name=$(basename "$run")
    cmp "$run"/*/samples.csv "$folder/results/$other/$name"/*/samples.csv || different=1
    # Replay the log of one build with the other.
    program=$folder-$other/src/cli/upright
    [ -x "$program" ] || continue
    "$program" replay "$run"/* >/dev/null || { echo "$other cannot replay $run" >&2; different=1; }
  done
done
runs=$(find "$folder/results/$first" -name samples.csv | wc -l)
echo "logs compared: $runs runs each of ${programs[*]} and with an older libm"

if [ -z "${UPRIGHT_SKIP_PAPER:-}" ]; then
  for arch in "${programs[@]}"; do
    "$folder-$arch/src/cli/upright" paper --config config --out "$folder/paper-$arch" --overwrite >/dev/null
    diff -r "$folder/paper-$first" "$folder/paper-$arch" || different=1
  done
  echo "paper compared: ${programs[*]}"
fi
[ $different = 0 ] && echo "all results are identical" || { echo "results DIFFER: see the lines above" >&2; exit 1; }
