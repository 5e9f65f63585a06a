#!/usr/bin/env bash
# Runs the tests that need the kernel's own GPIO and Comedi devices: boots Debian's kernel in QEMU (no KVM needed) with
# gpio-sim and comedi_test, and prints what the test programs say. The programs and the modules each asks for are listed
# in tests/kernel/CMakeLists.txt.
#   scripts/test-kernel.sh [PROGRAM...]    all programs when none is named
# They are built with the preset ci, which keeps to what the guest's processor can do.
# Ends with the programs' exit code, or with 77 where the kernel's packages are not to be had. An emulated processor says
# what is right and what is wrong, never how fast. Kernel and modules are kept in build/kernel-test.
set -euo pipefail
cd "$(dirname "$0")/.."

cache=$PWD/build/kernel-test
guests=2  # an emulated processor each, with a share of each program's tests
patience_s=270

skip() {
  echo "!!" >&2
  echo "!! THE KERNEL TESTS DID NOT RUN: $*" >&2
  echo "!!" >&2
  exit 77
}

# The kernel, its Comedi modules, and gpio-sim with irq_sim, which Debian has the source of but does not build.
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
  # As a module it may not touch the interrupt's descriptor itself, and must say its licence.
  sed -i -e 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq(irqnum)/' \
    -e '1a #include <linux/module.h>' -e '$a MODULE_LICENSE("GPL");' "$work/modules/irq_sim.c"
  echo 'obj-m := irq_sim.o gpio-sim.o' >"$work/modules/Kbuild"
  # The headers are not installed: they lie in the cache, and must look for each other there.
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

# copy FILE...: into the guest, to the same path, with the libraries it needs.
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

# What the fault suite has seen in the guest, against its columns of docs/reference/faults.md.
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

scripts/install-deps.sh --kernel || skip "qemu and busybox are not to be had"
problem=0
make_kernel || problem=$?
[ "$problem" -ne 2 ] || { echo "look at the lines above: gpio-sim does not build" >&2; exit 1; }
[ -e "$cache/version" ] || skip "the kernel's packages are not to be had"
[ "$problem" -eq 0 ] || echo "the kernel's packages are not to be had: running the $(cat "$cache/version") at hand" >&2

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
[ -e "$guest/programs" ] || { echo "name one of these programs:" >&2; cat "$build/tests/kernel/programs" >&2; exit 2; }
write_init
(cd "$guest" && find . | busybox cpio -o -H newc 2>/dev/null) | gzip -1 >"$guest.gz"

# The guest's clock follows the instructions it has executed, and leaps while it idles: it is never late because the machine
# around it is busy. What the kernel does not know on its command line is its first process's environment.
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
  [ -n "$said" ] || { echo "look at the lines above: guest $i did not end within $patience_s s" >&2; exit 1; }
  [ "$said" -eq 0 ] || status=$said
done
[ "$status" -eq 0 ] || exit "$status"
compare_outcomes
