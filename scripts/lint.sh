#!/usr/bin/env bash
# clang-tidy over our own sources. A file that was clean is not looked at again until it, a header of it, or the
# checks change: looking at all of them takes longer than everything else.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-deps.sh --dev
cmake --preset ci >/dev/null
clean=${XDG_CACHE_HOME:-$HOME/.cache}/upright-lint
mkdir -p "$clean"
export clean

lint() {
  local file=$1 include key
  # The text the compiler would see, less where the repository happens to lie.
  include=$(printf -- '-isystem %s ' /usr/include/eigen3)
  key=$({
    clang-tidy-14 --version
    cat .clang-tidy
    clang++-14 -E -P -std=c++20 -march=native -Iinclude -I"$(dirname "$file")" $include "$file" 2>/dev/null ||
      { find include src hal sim -name '*.hpp' -o -name '*.cpp' | sort | xargs cat; }
  } | sed "s#$PWD##g" | sha256sum | cut -d' ' -f1)
  [ ! -e "$clean/$key" ] || return 0
  # The compile commands are g++'s; clang need not know all of its warnings.
  clang-tidy-14 -quiet --extra-arg=-Wno-unknown-warning-option -p build/ci "$file" 2>/dev/null || {
    echo "lint: $file" >&2
    return 1
  }
  touch "$clean/$key"
}
export -f lint
git ls-files 'src/*.cpp' 'hal/*.cpp' 'sim/*.cpp' | xargs -P "$(nproc)" -I{} bash -c 'lint {}'
