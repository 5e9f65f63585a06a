#!/usr/bin/env bash
# Computes the paper's figures and tables and writes docs/paper.md and docs/paper/. Builds the program first.
#   scripts/reproduce-paper.sh [FOLDER]     FOLDER replaces docs
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh release upright
build/release/src/cli/upright paper --config config --out "${1:-docs}" --overwrite
