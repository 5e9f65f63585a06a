#!/usr/bin/env bash
# The first ten minutes with a Quanser card, step by step, and the evidence of them in one folder:
#   scripts/quanser-first-day.sh RIG GAINS [--without-motor]
# Begins with the amplifier off and the pendulum hanging at rest, and asks before anything moves. docs/how-to/first-rig.md says
# what it is for.
set -uo pipefail

usage() { echo "usage: scripts/quanser-first-day.sh RIG GAINS [--without-motor]" >&2; exit 2; }
[ $# -ge 2 ] && [ $# -le 3 ] && [ "${3:---without-motor}" = --without-motor ] || usage
rig=$(realpath -- "$1") gains=$(realpath -- "$2") motor=${3:-with-motor}
cd "$(dirname "$0")/.." || exit 2
upright=${UPRIGHT:-$(scripts/program.sh)}
folder=$PWD/quanser-first-day-$(date -u +%Y%m%dT%H%M%SZ)
mkdir -p "$folder" || exit 2
proof=$folder/proof.txt
failed=0

say() { printf '%s\n' "$*" | tee -a "$proof"; }

# ask WORDS: waits for Enter.
ask() { printf '\n>>> %s, then press Enter: ' "$*"; read -r _ || { echo "nobody answered" >&2; exit 2; }; }

# judged PASSED STEP: a line of the proof.
judged() { if [ "$1" -eq 0 ]; then say "passed  $2"; else say "FAILED  $2"; failed=1; fi; }

# step NAME FILE COMMAND...: its output is shown and kept.
step() {
  local name=$1 file=$folder/$2 status
  shift 2
  echo
  "$@" 2>&1 | tee "$file"
  status=${PIPESTATUS[0]}
  judged "$status" "$name ($(basename "$file"))"
  return "$status"
}

cp -- "$rig" "$gains" "$folder"
say "Quanser card, first day, $(date -u +%Y-%m-%dT%H:%M:%SZ), on $(uname -srm)"
say "upright: $("$upright" --version 2>/dev/null | head -n 1)"
(lsusb || true) >"$folder/lsusb.txt" 2>&1

step "the files are valid" check.txt "$upright" check "$rig" "$gains" || exit 1
ask "switch the amplifier OFF and let the pendulum hang at rest, the cart in the middle"
step "library, card, output, encoders, watchdog, link and signs by hand" doctor.txt \
  "$upright" doctor --rig "$rig" --gains "$gains" --seconds 5 --by-hand || exit 1
grep -E 'Quanser|link:|sign' "$folder/doctor.txt" | sed 's/^/        /' | tee -a "$proof"
if [ "$motor" = --without-motor ]; then
  say "left out: everything with the motor on"
  exit "$failed"
fi

ask "switch the amplifier ON, a hand on its switch, and let the pendulum hang at rest, the cart in the middle"
step "the voltage moves the cart the right way" sign-check.txt \
  "$upright" experiment config/experiments/sign-check.yaml --rig "$rig" --out "$folder/sign-check" || exit 1

ask "the cart is in the middle, the pendulum hangs at rest; after this, lift it upright and let go when the motor takes over"
step "it balances for 10 s" run.txt \
  "$upright" run --rig "$rig" --gains "$gains" --duration 10 --label balance --out "$folder"

ask "the same once more: this run is killed after 5 s of balancing, and you look whether the motor stops at once"
"$upright" run --rig "$rig" --gains "$gains" --duration 60 --label killed --out "$folder" >"$folder/killed.txt" 2>&1 &
run=$!
for _ in $(seq 600); do
  rows=$(cat "$folder"/*-killed*/samples.csv 2>/dev/null | wc -l)
  [ "$rows" -gt 100 ] && break
  kill -0 "$run" 2>/dev/null || break
  sleep 0.1
done
sleep 5
kill -KILL "$run" 2>/dev/null
wait "$run" 2>/dev/null
printf '\n>>> it was killed. Did the motor stop at once? [y/n] '
read -r answer
[ "$answer" = y ]
judged $? "after kill -9 the card's watchdog stopped the motor (said by the operator)"

ask "switch the amplifier OFF"
step "the card works again after its watchdog locked it" doctor-again.txt \
  "$upright" doctor --rig "$rig" --gains "$gains" --seconds 2
say ""
if [ "$failed" -eq 0 ]; then say "All steps passed."; else say "Some steps failed."; fi
echo "evidence: $folder"
exit "$failed"
