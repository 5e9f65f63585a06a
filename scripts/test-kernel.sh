#!/usr/bin/env bash
# Runs the tests that need the GPIO and Comedi devices of the kernel: boots Debian's kernel in QEMU (KVM is not needed)
# with gpio-sim and comedi_test, and prints the output of the test programs. tests/kernel/CMakeLists.txt lists the
# programs and the modules that each requires.
#   scripts/test-kernel.sh [PROGRAM...]    default: all programs
# The programs are built with the preset ci, which uses only instructions that the guest's processor has.
# The exit code is that of the programs, or 77 if the kernel's packages are not available. An emulated processor tests
# correctness, not speed. The kernel and its modules are kept in build/kernel-test.
set -euo pipefail
cd "$(dirname "$0")/.."

cache=$PWD/build/kernel-test
guests=2  # each is an emulated processor that runs a share of the tests
patience_s=270

skip() {
  echo "!!" >&2
  echo "!! THE KERNEL TESTS DID NOT RUN: $*" >&2
  echo "!!" >&2
  exit 77
}

# Gets the kernel and its Comedi modules, and builds gpio-sim and irq_sim, which Debian ships as source only.
make_kernel() {
  local image version work root source module
  image=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/^ *Depends: //p' | head -n 1)
  [ -n "$image" ] || return 1
  version=${image#linux-image-}
  [ "$(cat "$cache/version" 2>/dev/null)" != "$version" ] || return 0
  echo "fetching Debian's kernel $version and building gpio-sim for it"
  work=$PWD/build/kernel-test.work root=$work/root source=linux-source-6.1
  rm -rf "$work"
  mkdir -p "$root" "$work/packages" "$work/modules"
  (cd "$work/packages" && apt-get -qq -o APT::Sandbox::User=root download "$image" "$source" \
    "linux-headers-$version" "linux-headers-${version%-amd64}-common" linux-kbuild-6.1) || return 1
  for package in "$work"/packages/linux-{image,headers,kbuild}*.deb; do dpkg -x "$package" "$root"; done
  dpkg-deb --fsys-tarfile "$work"/packages/$source*.deb | tar -x -O "./usr/src/$source.tar.xz" |
    tar -xJ -C "$work" "$source/kernel/irq/irq_sim.c" "$source/drivers/gpio/gpio-sim.c" "$source/drivers/gpio/gpiolib.h"
  cp "$work/$source/kernel/irq/irq_sim.c" "$work/$source"/drivers/gpio/gpio{-sim.c,lib.h} "$work/modules"
  # As a module, irq_sim cannot access the interrupt descriptor directly, and must declare its licence.
  sed -i -e 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq(irqnum)/' \
    -e '1a #include <linux/module.h>' -e '$a MODULE_LICENSE("GPL");' "$work/modules/irq_sim.c"
  echo 'obj-m := irq_sim.o gpio-sim.o' >"$work/modules/Kbuild"
  # The headers are not installed but unpacked in the cache, so their paths must point there.
  sed -i "s#/usr/src#$root/usr/src#" "$root/usr/src/linux-headers-$version/Makefile"
  make -C "$root/usr/src/linux-headers-$version" M="$work/modules" modules >"$work/modules.log" 2>&1 ||
    { tail -n 20 "$work/modules.log" >&2; return 2; }
  rm -rf "$cache"
  module=$cache/root/lib/modules/$version
  mkdir -p "$module/kernel"
  cp -r "$root/lib/modules/$version"/kernel/{drivers/comedi,fs/configfs} "$module/kernel"
  cp "$work"/modules/*.ko "$root/lib/modules/$version"/modules.{order,builtin} "$module"
  busybox depmod -b "$cache/root" "$version" && cp "$root/boot/vmlinuz-$version" "$cache/vmlinuz" &&
    echo "$version" >"$cache/version" || return 2
  rm -rf "$work"
}

# copy FILE...: copies files and the libraries they need into the guest, to the same paths.
copy() {
  local file library
  for file in "$@"; do
    mkdir -p "$guest$(dirname "$file")"
    cp "$file" "$guest$file"
    { ldd "$file" 2>/dev/null || true; } | sed -n 's#^[^/]*\(/[^ ]*\) (0x.*#\1#p' | while read -r library; do
      [ -e "$guest$library" ] || { mkdir -p "$guest$(dirname "$library")" && cp "$library" "$guest$library"; }
    done
  done
}

# Compares the results of the fault suite in the guest with its columns of docs/reference/faults.md.
compare_outcomes() {
  local records=$build/kernel_fault_records name cell
  [[ $(cat "$guest/programs") == *kernel_fault_test* ]] || return 0
  rm -rf "$records"
  mkdir -p "$records"
  sed -n 's/^guest: outcome //p' "$consoles"/* | while read -r name cell; do printf '%s' "$cell" >"$records/$name"; done
  "$build/tests/fault/faults_document" "$records" docs/reference/faults.md gpio comedi
}

write_init() {
  cat >"$guest/init" <<'INIT'
#!/bin/sh
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t devtmpfs devtmpfs /dev
mkdir -p /dev/shm
ip link set lo up
modprobe configfs && mount -t configfs configfs /sys/kernel/config
export GTEST_COLOR=no UPRIGHT_RETRY_LOG=/retries_and_skips.log
status=0
while read -r program modules; do
  for module in $modules; do modprobe "$module" || status=1; done
  echo "== $(basename "$program")"
  "$program" || { status=$?; echo "== $(basename "$program") FAILED ($status)"; }
done </programs
for record in /records/*; do [ ! -e "$record" ] || echo "guest: outcome $(basename "$record") $(cat "$record")"; done
[ ! -e "$UPRIGHT_RETRY_LOG" ] || sed "s/^/guest: counted /" "$UPRIGHT_RETRY_LOG"
echo "guest: exit $status"
poweroff -f
INIT
  chmod +x "$guest/init"
}

scripts/install-deps.sh --kernel || skip "qemu and busybox cannot be installed"
problem=0
make_kernel || problem=$?
[ "$problem" -ne 2 ] || { echo "gpio-sim does not build: see the lines above" >&2; exit 1; }
[ -e "$cache/version" ] || skip "the kernel's packages are not available"
[ "$problem" -eq 0 ] || echo "the kernel's packages are not available: using the cached $(cat "$cache/version")" >&2

build=build/ci
scripts/build.sh ci kernel_tests

guest=$(mktemp -d)
consoles=$(mktemp -d)
trap 'rm -rf "$guest" "$guest.gz" "$consoles"' EXIT
mkdir -p "$guest"/{bin,proc,sys,dev,tmp,records} "$guest$PWD/$build"
ln -s /records "$guest$PWD/$build/fault_records"
cp /bin/busybox "$guest/bin/busybox"
ln -s busybox "$guest/bin/sh"
cp -r "$cache/root/lib" "$guest"
mkdir -p "$guest$PWD"
cp -r config "$guest$PWD"
while read -r file; do copy "$file"; done <"$build/tests/kernel/files"
while read -r program modules; do
  if [ $# -gt 0 ] && ! [[ " $* " == *" $(basename "$program") "* ]]; then continue; fi
  copy "$program"
  echo "$program $modules" >>"$guest/programs"
done <"$build/tests/kernel/programs"
[ -e "$guest/programs" ] || {
  echo "there is no such program: name one of these:" >&2
  cat "$build/tests/kernel/programs" >&2
  exit 2
}
write_init
(cd "$guest" && find . | busybox cpio -o -H newc 2>/dev/null) | gzip -1 >"$guest.gz"

# The guest's clock counts executed instructions and jumps ahead while the guest idles, so a busy host does not delay
# it. The kernel passes unknown options of its command line to the first process as environment variables.
boot() {
  timeout "$patience_s" qemu-system-x86_64 -accel tcg -icount shift=2,sleep=off -M q35 -cpu max -smp 1 -m 512 \
    -kernel "$cache/vmlinuz" -initrd "$guest.gz" -nodefaults -nographic -no-reboot -serial stdio -append \
    "console=ttyS0 quiet panic=-1 comedi.comedi_num_legacy_minors=4 GTEST_TOTAL_SHARDS=$guests GTEST_SHARD_INDEX=$1" \
    </dev/null | sed -u 's/\r//g' | tee "$consoles/$1" | sed -u "s/^/$1: /" || true
}
for ((i = 0; i < guests; ++i)); do boot "$i" & done
wait
sed -n 's/^guest: counted //p' "$consoles"/* >>"$build/retries_and_skips.log"
status=0
for ((i = 0; i < guests; ++i)); do
  said=$(sed -n 's/^guest: exit \([0-9]*\)$/\1/p' "$consoles/$i")
  [ -n "$said" ] || { echo "guest $i did not end within $patience_s s: see the lines above" >&2; exit 1; }
  [ "$said" -eq 0 ] || status=$said
done
[ "$status" -eq 0 ] || exit "$status"
compare_outcomes
