#!/usr/bin/env bash
# Recomputes the paper's figures and tables into docs/paper.md and docs/paper/. Builds what is needed first.
#   scripts/reproduce-paper.sh [FOLDER]     FOLDER is docs when none is named
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh release upright
build/release/src/cli/upright paper --config config --out "${1:-docs}" --overwrite
