#!/usr/bin/env bash
# Computes the paper's figures and tables and writes docs/paper.md and docs/paper/. Builds the program first, unless UPRIGHT
# names one.
#   scripts/reproduce-paper.sh [FOLDER]     FOLDER replaces docs
set -euo pipefail
cd "$(dirname "$0")/.."

if [ -z "${UPRIGHT:-}" ]; then
  scripts/build.sh release upright
  UPRIGHT=build/release/src/cli/upright
fi
"$UPRIGHT" paper --config config --out "${1:-docs}" --overwrite
