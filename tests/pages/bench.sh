# What stands in for a rig while the commands of a page run. Sourced by scripts/check_commands.py before each block; `bench`
# is a folder that lasts as long as the page.

export USER=${USER:-$(id -un)}

# serve COMMAND...: starts a server and waits until it listens.
serve() {
  : >"$bench/server.out"  # what the previous server said
  "$@" >"$bench/server.out" 2>"$bench/server.err" </dev/null &
  local server=$!
  echo "$server" >>"$bench/servers"
  for _ in $(seq 100); do
    ! grep -q '^listening on ' "$bench/server.out" || return 0
    kill -0 "$server" 2>/dev/null || break
    sleep 0.1
  done
  cat "$bench/server.err" >&2
  return 1
}

# Ends the servers and waits until they are gone.
end_servers() {
  [ -e "$bench/servers" ] || return 0
  local server
  while read -r server; do
    kill "$server" 2>/dev/null || continue
    for _ in $(seq 100); do kill -0 "$server" 2>/dev/null || break; sleep 0.05; done
  done <"$bench/servers"
  rm "$bench/servers"
}

# A free port, where the virtual rig of this page listens from now on.
choose_port() {
  serve upright virtual-rig --rig config/rigs/modbus-tcp.yaml --tcp 127.0.0.1:0
  sed -n 's/^listening on .*://p' "$bench/server.out" >"$bench/port"
  end_servers
}

# copy_rig NAME: my-rig.yaml is this file of config/rigs.
copy_rig() { sed 's#\.\./plants/#config/plants/#' "config/rigs/$1.yaml" >my-rig.yaml; }

# simulated_rig: my-rig.yaml is the simulated rig, my-gains.yaml and my-plant.yaml belong to it.
simulated_rig() {
  copy_rig simulated
  cp config/gains/exponential.yaml my-gains.yaml
  cp config/plants/viscous.yaml my-plant.yaml
}

# tcp_rig: the same for a Modbus TCP device on this machine; its rate leaves time to a busy machine.
tcp_rig() {
  choose_port
  copy_rig modbus-tcp
  sed -i "s/port: 1502/port: $(cat "$bench/port")/; s/response_timeout_s: .*/response_timeout_s: 0.004/" my-rig.yaml
  cp config/gains/exponential-200hz.yaml my-gains.yaml
  cp config/plants/exponential.yaml my-plant.yaml
}

# tcp_device ANGLE HANG_S: the device of tcp_rig with its plant. The pendulum hangs for HANG_S from the first request on, then
# it is at ANGLE.
tcp_device() {
  end_servers
  serve upright virtual-rig --rig my-rig.yaml --tcp "127.0.0.1:$(cat "$bench/port")" --theta0-deg "$1" --hang "$2"
}

# board_device ANGLE HANG_S: the same map as a board on a serial line; ANGLE and HANG_S as for tcp_device.
# my-rig.yaml is config/rigs/board.yaml with the response timeout that the page asks for; its watchdog leaves time to a busy
# machine.
board_device() {
  end_servers
  copy_rig board
  echo 'simulated: {plant: config/plants/exponential.yaml, initial: {cart_m: 0.0, theta_rad: 3.14159}}' >>my-rig.yaml
  sed -i "s#/dev/ttyACM0#$bench/line#; s/response_timeout_s: .*/response_timeout_s: 0.008/;
    s/^watchdog_s: .*/watchdog_s: 0.5/" my-rig.yaml
  serve upright virtual-rig --rig my-rig.yaml --rtu "$bench/line" --theta0-deg "$1" --hang "$2" --no-pace
}

# example_runs COUNT: runs of the simulated rig with the paper's friction.
example_runs() {
  local number
  for number in $(seq "$1"); do
    upright run --rig config/rigs/simulated.yaml --gains config/gains/viscous.yaml --fast \
      --theta0-deg "$((number + 3))" --delay "0.00$((number * 2))" --duration 4 --label "data$number" >/dev/null
  done
}

# quanser_rig: quanser.yaml is the file of a Q2-USB on the library of tests/fault/fake_hil.
quanser_rig() {
  sed "s#library: libhil.so#library: ${fake_hil:?names the library of tests/fault/fake_hil}#;
    s#board_identifier: \"0\"#board_identifier: \"0@unix:$bench/card\"#" config/rigs/quanser-q2-usb.yaml >quanser.yaml
  cp quanser.yaml "$bench/quanser.yaml"
}

# quanser_card OPTIONS...: its card, with these options.
quanser_card() {
  end_servers
  rm -f "$bench/card"
  serve "${fake_card:?names the program fake_hil_card}" --rig "$bench/quanser.yaml" --socket "$bench/card" "$@"
}

# free_decay FILE: 8 s of a pendulum that swings out, as published: columns t_s and theta_rad, 0 is upright.
free_decay() {
  mkdir -p "$(dirname "$1")"
  awk 'BEGIN {
    print "t_s,theta_rad"
    for (k = 0; k <= 1600; ++k) { t = k / 200; printf "%.3f,%.5f\n", t, 3.14159 + 0.3 * exp(-0.05 * t) * cos(5.2 * t) }
  }' >"$1"
}
