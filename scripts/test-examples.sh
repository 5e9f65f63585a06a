#!/usr/bin/env bash
# Builds and runs the examples from the Debian package, unpacked into a folder: nothing of this tree is used.
#   scripts/test-examples.sh PACKAGE
set -euo pipefail
cd "$(dirname "$0")/.."

package=$1
work=build/examples
rm -rf "$work"
mkdir -p "$work"
work=$(realpath "$work")
dpkg-deb --extract "$package" "$work/root"
share=$work/root/usr/share/upright
options=(-DCMAKE_PREFIX_PATH="$work/root/usr" -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Wshadow -Werror")
if command -v ccache >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
fi

# The targets name no processor, and nothing of the tree that built them.
if grep -rnE -e "-march|$PWD/(include|src|sim|hal)" "$work/root/usr/lib/x86_64-linux-gnu/cmake/upright"; then
  echo "the exported targets have options of this build: keep them out" >&2
  exit 1
fi

# build EXAMPLE TARGET
build() {
  local log=$work/$1.log
  { cmake -S "$share/examples/$1" -B "$work/$1" -G Ninja "${options[@]}" && cmake --build "$work/$1" --target "$2"; } >"$log" 2>&1 ||
    { tail -n 40 "$log" >&2; return 1; }
}
cd "$work"
echo "== headers"
# None includes a header that is not installed.
(cd root/usr/include && find upright -name '*.hpp' -printf '#include "%p"\n' | sort) >headers.cpp
c++ -std=c++20 -fsyntax-only -Wall -Wextra -Wpedantic -Wshadow -Werror -DEIGEN_MAX_ALIGN_BYTES=64 -Iroot/usr/include \
  -isystem /usr/include/eigen3 headers.cpp
echo "== swing-up"
build swing-up swing_up
swing-up/swing_up "$share/config/rigs/simulated.yaml" "$share/config/gains/exponential.yaml"
echo "== own-rig"
build own-rig own_rig
own-rig/own_rig "$share/config/rigs/simulated.yaml" "$share/config/gains/exponential.yaml" "$share/config/plants/exponential.yaml"
echo "== own-effect"
build own-effect brake
own-effect/brake "$share/examples/own-effect/braked-cart.yaml"
# Without the header the kind is unknown.
! "$work/root/usr/bin/upright" check "$share/examples/own-effect/braked-cart.yaml" 2>/dev/null
