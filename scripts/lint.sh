#!/usr/bin/env bash
# Runs clang-tidy on all sources with the checks of .clang-tidy.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-deps.sh --dev
cmake --preset ci -DUPRIGHT_MPI=OFF -DUPRIGHT_UNITY=OFF -B build/lint >/dev/null
cmake --build build/lint --target upright_build_info embedded_texts >/dev/null
python3 scripts/lint.py build/lint/compile_commands.json src hal sim studies
