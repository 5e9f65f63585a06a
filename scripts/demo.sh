#!/usr/bin/env bash
# Balances the pendulum for 10 s without hardware. A Modbus server simulates the plant in real time, and the controller
# communicates with it over TCP as with a real rig. Installs missing packages; requires only git and apt.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-deps.sh
scripts/build.sh release upright
upright=build/release/src/cli/upright

work=$(mktemp -d)
server=
finish() {
  if [ -n "$server" ]; then
    kill "$server" 2>/dev/null || true
    wait "$server" 2>/dev/null || true
  fi
  rm -rf "$work"
}
trap finish EXIT

# Port 0 selects a free port, which the virtual rig prints.
"$upright" virtual-rig --rig config/rigs/modbus-tcp.yaml --plant config/plants/exponential.yaml \
  --tcp 127.0.0.1:0 --theta0-deg 3 >"$work/server.out" &
server=$!
port=
for _ in $(seq 100); do
  port=$(sed -n 's/^listening on .*:\([0-9]*\)$/\1/p' "$work/server.out")
  [ -z "$port" ] || break
  kill -0 "$server" 2>/dev/null || exit 4 # it has printed the reason
  sleep 0.1
done
[ -n "$port" ] || { echo "the virtual rig did not start within 10 s: reduce the load on this computer" >&2; exit 4; }

sed -e "s/^  port: .*/  port: $port/" -e "s#\.\./plants/#$PWD/config/plants/#" config/rigs/modbus-tcp.yaml >"$work/rig.yaml"

# --unchecked: the signs of a virtual rig match its file. A stopped run (exit code 3) also has data and a report.
status=0
# --plant: the run then states the delay margin, and stops for late periods only where that is used up.
"$upright" run --rig "$work/rig.yaml" --plant config/plants/exponential.yaml --gains config/gains/exponential.yaml \
  --duration 10 --label demo --unchecked >"$work/run.out" || status=$?
[ "$status" -eq 0 ] || [ "$status" -eq 3 ] || exit "$status"

run=$(tail -n 1 "$work/run.out")
echo
echo "run directory: $run"
sed '$d' "$work/run.out"
echo "report: $("$upright" report "$run")"
exit "$status"
