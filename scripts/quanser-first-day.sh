#!/usr/bin/env bash
# Guides through the first ten minutes with a Quanser card and records each step in one folder:
#   scripts/quanser-first-day.sh RIG GAINS [--without-motor]
# Starts with the amplifier off and the pendulum hanging at rest, and asks before anything moves. See
# docs/how-to/first-rig.md.
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
ask() {
  printf '\n>>> %s, then press Enter: ' "$*"
  read -r _ || { echo "no answer was received: run this script in a terminal" >&2; exit 2; }
}

# judged STATUS STEP: writes the result of a step to the record.
judged() { if [ "$1" -eq 0 ]; then say "passed  $2"; else say "FAILED  $2"; failed=1; fi; }

# step NAME FILE COMMAND...: runs a command, and shows and records its output.
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
say "First day with a Quanser card, $(date -u +%Y-%m-%dT%H:%M:%SZ), on $(uname -srm)"
say "upright: $("$upright" --version 2>/dev/null | head -n 1)"
(lsusb || true) >"$folder/lsusb.txt" 2>&1

step "the files are valid" check.txt "$upright" check "$rig" "$gains" || exit 1
ask "switch the amplifier OFF, move the cart to the middle and let the pendulum hang at rest"
step "library, card, output, encoders, watchdog, link and encoder signs" doctor.txt \
  "$upright" doctor --rig "$rig" --gains "$gains" --seconds 5 --by-hand || exit 1
grep -E 'Quanser|link:|sign' "$folder/doctor.txt" | sed 's/^/        /' | tee -a "$proof"
if [ "$motor" = --without-motor ]; then
  say "skipped  all steps with the motor on"
  exit "$failed"
fi

ask "move the cart to the middle, let the pendulum hang at rest, switch the amplifier ON, and keep a hand on its switch"
step "a positive voltage moves the cart in the +x direction" sign-check.txt \
  "$upright" experiment config/experiments/sign-check.yaml --rig "$rig" --out "$folder/sign-check" || exit 1

ask "move the cart to the middle and let the pendulum hang at rest; after Enter, lift the pendulum upright and let go" \
  "when the motor takes over"
step "the rig balances for 10 s" run.txt \
  "$upright" run --rig "$rig" --gains "$gains" --duration 10 --label balance --out "$folder"

ask "prepare the same start again; after 5 s of balancing the program is killed: watch whether the motor stops at once"
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
printf '\n>>> The program was killed. Did the motor stop at once? [y/n] '
read -r answer
[ "$answer" = y ]
judged $? "after kill -9 the card's watchdog stopped the motor (as observed by the operator)"

ask "switch the amplifier OFF"
step "the card works again after its watchdog had locked it" doctor-again.txt \
  "$upright" doctor --rig "$rig" --gains "$gains" --seconds 2
say ""
if [ "$failed" -eq 0 ]; then say "All steps passed."; else say "Some steps failed: see the lines marked FAILED."; fi
echo "record: $folder"
exit "$failed"
