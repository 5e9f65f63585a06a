#!/usr/bin/env bash
# Installs the Debian 12 packages that upright requires. Does nothing if all are installed.
#   scripts/install-deps.sh           packages for building and for the demo
#   scripts/install-deps.sh --test    also the browser for the tests of the live page
#   scripts/install-deps.sh --kernel  also QEMU and busybox for the kernel tests of GPIO and Comedi
#   scripts/install-deps.sh --package also what builds and tests the Debian package
#   scripts/install-deps.sh --dev     also everything for .ci/run: all of these, clang's formatter, linter, sanitizers and
#                                     fuzzer, ccache, compiler and emulator for the board's firmware, a spelling checker
set -euo pipefail

packages=(
  build-essential cmake ninja-build git ca-certificates
  libeigen3-dev libsundials-dev libmodbus-dev libcomedi-dev libgpiod-dev libyaml-cpp-dev libcli11-dev libboost-dev nlohmann-json3-dev
  libmatio-dev libhdf5-dev libzip-dev libcpp-httplib-dev libxsimd-dev libceres-dev libnlopt-cxx-dev libopenmpi-dev openmpi-bin
  libgtest-dev libbenchmark-dev
  gnuplot-nox python3-venv
)
test_packages=(chromium chromium-driver)
kernel_packages=(qemu-system-x86 busybox-static libelf1)
packaging_packages=(dpkg-dev file lintian debootstrap)
development_packages=(
  clang-14 clang-format-14 clang-tidy-14 clang-tools-14 libclang-rt-14-dev libomp-14-dev ccache
  gcc-avr avr-libc libsimavr-dev codespell doxygen
)
case "${1:-}" in
  '') ;;
  --test) packages+=("${test_packages[@]}") ;;
  --kernel) packages+=("${kernel_packages[@]}") ;;
  --package) packages+=("${packaging_packages[@]}") ;;
  --dev) packages+=("${test_packages[@]}" "${kernel_packages[@]}" "${packaging_packages[@]}" "${development_packages[@]}") ;;
  *) echo "usage: scripts/install-deps.sh [--test | --kernel | --package | --dev]" >&2; exit 2 ;;
esac

command -v apt-get >/dev/null || {
  echo "apt-get is not available: install these packages by other means: ${packages[*]}" >&2
  exit 2
}

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || {
    echo "packages are missing: ${missing[*]}: run this script as root, or install sudo" >&2
    exit 2
  }
  as_root=(sudo)
fi

echo "installing: ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
quietly() {
  "$@" </dev/null >"$log" 2>&1 || { tail -n 30 "$log" >&2; return 1; }
}
quietly "${as_root[@]}" apt-get update ||
  echo "the package lists could not be updated; continuing with the present lists" >&2
quietly "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}"
