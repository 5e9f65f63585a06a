#!/usr/bin/env bash
# Builds one CMake preset (default: release) into build/PRESET, with ccache if it is installed.
#   scripts/build.sh [PRESET] [ninja arguments, e.g. the targets]
set -euo pipefail
cd "$(dirname "$0")/.."

preset=${1:-release}
shift || true

# The cache of a moved clone names another path, and CMake would refuse it.
cache=build/$preset/CMakeCache.txt
if [ -e "$cache" ] && ! grep -q "^CMAKE_HOME_DIRECTORY:INTERNAL=$PWD\$" "$cache"; then
  rm -rf "build/$preset"
fi

options=()
if command -v ccache >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
  export CCACHE_SLOPPINESS=pch_defines,time_macros  # required by its manual for precompiled headers
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
cmake --preset "$preset" "${options[@]}" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
cmake --build --preset "$preset" -- "$@"
