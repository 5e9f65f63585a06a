#!/usr/bin/env bash
# Fuzzes the file readers, starting from the repository's own files.
#   scripts/fuzz.sh [SECONDS]       60 when none are named
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=${1:-60}
scripts/install-deps.sh --dev
scripts/build.sh fuzz reader_fuzz

corpus=$(mktemp -d)
trap 'rm -rf "$corpus"' EXIT
number=0
for file in config/*/*.yaml tests/acceptance/malformed/*/*.yaml; do
  [ -e "$file" ] || continue
  number=$((number + 1))
  cp "$file" "$corpus/$number"
done
mkdir -p build/fuzz/found
build/fuzz/tests/fuzz/reader_fuzz -max_total_time="$seconds" -max_len=4096 -timeout=10 -rss_limit_mb=2048 \
  -dict=tests/fuzz/reader.dict -artifact_prefix=build/fuzz/found/ -print_final_stats=1 "$corpus"
