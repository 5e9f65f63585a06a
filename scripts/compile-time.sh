#!/usr/bin/env bash
# Measures the processor time of a clean build of the program, without the cache, at each commit. Machines are noisy: compare
# commits of one call only, in several rounds.
#   scripts/compile-time.sh [--rounds N] COMMIT...     prints a line for each commit and round
set -euo pipefail
cd "$(dirname "$0")/.."

rounds=1
if [ "${1:-}" = --rounds ]; then
  rounds=$2
  shift 2
fi
[ $# -gt 0 ] || { echo "name one or more commits" >&2; exit 2; }

folder=$PWD/build/compile-time
mkdir -p "$folder"
trap 'rm -rf "$folder"; git worktree prune' EXIT
TIMEFORMAT='%U s user, %S s system, %R s elapsed'
for _ in $(seq "$rounds"); do
  for commit in "$@"; do
    tree=$folder/$(git rev-parse --short "$commit")
    [ -e "$tree" ] || git worktree add --quiet --detach "$tree" "$commit"
    rm -rf "$tree/build"
    cmake -S "$tree" --preset ci -B "$tree/build/ci" -DBUILD_TESTING=OFF >/dev/null
    printf '%s: ' "$commit"
    time cmake --build "$tree/build/ci" --target upright >/dev/null
  done
done
