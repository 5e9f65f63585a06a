#!/usr/bin/env bash
# Builds the Debian package, checks it with lintian, installs it in a fresh Debian 12 without compilers, and uses it there as a
# user would who may not become root.
#   scripts/test-package.sh [PACKAGE]    default: builds it
# The fresh system is a folder made by debootstrap and entered by chroot, which only root can do. It is kept in
# build/package-test for 30 days. The exit code is 77 if there is no way to make it, with the reason.
set -euo pipefail
cd "$(dirname "$0")/.."

cache=$PWD/build/package-test
kept_days=30
mirror=http://deb.debian.org/debian

skip() {
  echo "!!" >&2
  echo "!! THE PACKAGE WAS NOT TESTED IN A FRESH SYSTEM: $*" >&2
  echo "!!" >&2
  exit 77
}

package=${1:-$(scripts/package.sh)}
echo "checking $(basename "$package"), $(($(stat -c %s "$package") / 1024)) KiB"
# As root lintian warns about itself.
scripts/test-examples.sh "$package"
lintian --allow-root --fail-on error --tag-display-limit 0 "$package"

[ "$(id -u)" -eq 0 ] || skip "only root can enter another system"
command -v debootstrap >/dev/null || skip "debootstrap is not installed"
mkdir -p "$cache"
find "$cache" -name fresh.tar -mtime +$kept_days -delete
root=$(mktemp -d "$cache/root.XXXXXX")
trap 'rm -rf "$root"' EXIT
if [ ! -e "$cache/fresh.tar" ]; then
  echo "making a fresh Debian 12"
  debootstrap --variant=minbase bookworm "$root" "$mirror" >"$cache/debootstrap.log" 2>&1 ||
    skip "debootstrap failed: $(tail -n 1 "$cache/debootstrap.log")"
  tar -cf "$cache/fresh.tar.new" -C "$root" .
  mv "$cache/fresh.tar.new" "$cache/fresh.tar"
else
  tar -xf "$cache/fresh.tar" -C "$root"
fi
# The root of a system is open to its users; the folder that mktemp makes is not.
chmod 755 "$root"
inside() {
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive chroot "$root" "$@"
}
# as_user COMMAND: with a login of its own, so that the limits of the group hold.
as_user() {
  inside su student --login --command "$1"
}
fail() {
  echo "$*" >&2
  exit 1
}

cp "$package" "$root/root/"
log=$cache/apt.log
cp /etc/resolv.conf "$root/etc/resolv.conf"
inside apt-get update >"$log" 2>&1 || skip "apt-get update failed: $(tail -n 1 "$log")"
inside apt-get install -y --no-install-recommends "/root/$(basename "$package")" >"$log" 2>&1 || { tail -n 30 "$log" >&2; exit 1; }
for compiler in cc gcc g++ c++ clang cmake; do
  ! inside sh -c "command -v $compiler" || fail "the fresh system has a compiler: $compiler"
done

echo "balancing the simulated rig"
inside adduser --quiet --disabled-password --gecos '' student
inside adduser --quiet student upright
share=/usr/share/upright/config
as_user "upright run --rig $share/rigs/simulated.yaml --gains $share/gains/exponential.yaml --fast"
as_user 'test -s "$(ls -d runs/*)/samples.csv" && upright replay runs/*'
as_user "upright check \$(find $share -name '*.yaml') >/dev/null"

echo "schemas of files"
for kind in rig gains plant sweep experiment dataset; do
  as_user "upright schema $kind | cmp - $share/schema/$kind.json" || fail "the package has another schema of $kind files than its program"
done

echo "limits, manual, completion"
if (ulimit -r 90) 2>/dev/null; then
  [ "$(as_user 'ulimit -r')" = 90 ] || fail "members of the group upright have no real-time priority: $(as_user 'ulimit -r')"
  [ "$(as_user 'ulimit -l')" = unlimited ] || fail "members of the group upright may not lock memory: $(as_user 'ulimit -l')"
else
  echo "!! NOT TESTED: the limits of the group, because root may not raise limits on this machine"
fi
grep -q '^usermod --append --groups upright student' <<<"$(as_user 'upright doctor --fix')" || fail "doctor --fix says nothing"
dpkg-deb --contents "$package" >"$cache/contents"
for file in man/man1/upright.1.gz man/man1/upright-run.1.gz bash-completion/completions/upright zsh/vendor-completions/_upright \
  fish/vendor_completions.d/upright.fish; do
  # A fresh system leaves manuals out of what it installs, as containers do: then the package itself must have them.
  grep -q " ./usr/share/$file\$" "$cache/contents" || fail "the package has no $file"
done
completed=$(inside bash -c "source /usr/share/bash-completion/completions/upright; COMP_WORDS=(upright run --rig $share/rigs/sim)
  COMP_CWORD=3; _upright; echo \"\${COMPREPLY[@]}\"")
[ "$completed" = "$share/rigs/simulated.yaml" ] || fail "bash completes '$completed'"

echo "lanes for each kind of registers"
printf '%s\n' "sweep: {plant: $share/plants/exponential.yaml, gains: $share/gains/exponential.yaml, loop: continuous," \
  "  theta0_deg: [0.1, 1.0, 5.0], delay_s: {from: 0.0, to: 0.1, count: 11}, duration_s: 10," \
  "  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}, engine: fast}" >"$root/home/student/sweep.yaml"
for lanes in baseline avx2 avx512; do
  as_user "UPRIGHT_LANES=$lanes upright sweep sweep.yaml --out $lanes >/dev/null && cut -d, -f1-3 $lanes/sweep.csv >$lanes.csv"
  as_user "cmp baseline.csv $lanes.csv" || fail "the lanes for $lanes find another outcome than the baseline's"
done

echo "removing the package"
inside apt-get purge -y upright >"$log" 2>&1 || { tail -n 30 "$log" >&2; exit 1; }
left=$(inside find /etc /usr -path '*upright*' ! -path '*/dpkg/*')
[ -z "$left" ] || fail "removing the package leaves $left"
