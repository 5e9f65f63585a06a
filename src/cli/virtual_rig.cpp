// `upright virtual-rig`: the plant in real time behind a real Modbus server.
#include "hal/virtual_rig.hpp"

#include <csignal>
#include <iostream>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "commands.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::cli {

namespace {

struct Flags {
  std::string rig, tcp, rtu, plant, trace, stuck_encoder = "cart";
  std::optional<double> theta0_deg;
  double hang_s = 0.0, duration_s = 0.0, late_ms = 0.0;
  bool no_pace = false;
  InjectedFaults faults;
};

std::atomic<bool> stopped{false};

void stop_on_signal(int) {
  stopped.store(true);
}

/// "HOST:PORT", ":PORT" or "PORT"; without a host the loopback.
void take_address(const std::string& text, VirtualRigOptions& options) {
  const std::size_t colon = text.rfind(':');
  const std::string host = colon == std::string::npos ? "" : text.substr(0, colon);
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  options.tcp_host = host.empty() ? "127.0.0.1" : host == "localhost" ? "127.0.0.1" : host;
  const bool digits =
      !port.empty() && port.size() <= 5 && port.find_first_not_of("0123456789") == std::string::npos;
  options.tcp_port = digits ? std::stoi(port) : -1;
  if (options.tcp_port < 0 || options.tcp_port > 65535)
    throw ConfigError("'" + text +
                      "' has no port from 0 to 65535: use --tcp HOST:PORT, with port 0 for any free port");
}

/// Modbus asks nobody who he is: whoever reaches the port moves the rig.
void say_listening(const std::string& name, bool everybody) {
  std::cout << "listening on " << name << std::endl;
  if (everybody)
    std::cerr << "upright: warning: every machine that reaches " << name
              << " can drive this rig: use --tcp 127.0.0.1:PORT for this machine only" << std::endl;
}

Plant plant_for(const Flags& flags, const RigFile& rig) {
  if (!flags.plant.empty()) return read_plant_file(flags.plant);
  if (rig.simulated) return read_plant_file(rig.simulated->plant);
  throw ConfigError(rig.file.string() +
                    ":1: simulated.plant is missing: name a plant file with --plant, or add a simulated "
                    "section with a plant");
}

void serve(const Flags& flags) {
  const RigFile rig = read_rig_file(flags.rig);
  VirtualRigOptions options;
  if (flags.tcp.empty() == flags.rtu.empty())
    throw ConfigError("virtual-rig serves exactly one link: use either --tcp HOST:PORT or --rtu TTY");
  if (!flags.tcp.empty()) take_address(flags.tcp, options);
  options.serial_line = flags.rtu;
  options.pace = !flags.no_pace;
  if (rig.simulated) {
    options.theta0_rad = rig.simulated->initial.theta_rad;
    options.cart0_m = rig.simulated->initial.cart_m;
  }
  if (flags.theta0_deg) options.theta0_rad = *flags.theta0_deg * std::numbers::pi / 180.0;
  options.hang_s = flags.hang_s;
  options.trace = flags.trace;
  options.duration_s = flags.duration_s;
  options.faults = flags.faults;
  options.faults.late_s = flags.late_ms * 1e-3;
  options.faults.stick_cart = flags.stuck_encoder == "cart";
  const bool everybody = !options.tcp_host.empty() && options.tcp_host.rfind("127.", 0) != 0;
  options.listening = [everybody](const std::string& name) { say_listening(name, everybody); };
  const Plant plant = plant_for(flags, rig);
  // A terminal that goes away ends it as any other request does: with the trace written to its end.
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) std::signal(number, stop_on_signal);
  serve_virtual_rig(rig, plant, options, stopped);
}

}  // namespace

void add_virtual_rig(CommandLine& line) {
  auto flags = std::make_shared<Flags>();
  const Command command = line.command(
      "virtual-rig", "Simulate a rig in real time behind a Modbus server",
      "Example: upright virtual-rig --rig config/rigs/modbus-tcp.yaml --tcp 127.0.0.1:1502 --theta0-deg 3\n"
      "It prints 'listening on 127.0.0.1:1502' and serves until it is interrupted. The pendulum is held\n"
      "until the controller takes over; from then on the --inject options take effect.");
  command.option("--rig", flags->rig, "Rig file with the register map").required();
  command.option(
      "--tcp", flags->tcp,
      "HOST:PORT to listen on (default HOST: 127.0.0.1, this machine only); port 0 takes any free port");
  command.option("--rtu", flags->rtu,
                 "Serial line; if the path does not exist, a pseudo-terminal is created there");
  command
      .option("--theta0-deg", flags->theta0_deg,
              "Initial angle [degree], 0 is upright (default: that of the rig file)")
      .from_to(-360.0, 360.0);
  command
      .option(
          "--hang", flags->hang_s,
          "Time after the first request for which the pendulum hangs before it is lifted [s] (default: 0)")
      .from_to(0.0, 1e6);
  command.option("--plant", flags->plant, "Plant file (default: that of the rig file)");
  command.option("--trace", flags->trace,
                 "CSV file to write: time, voltage, position and angle of the plant");
  command.option("--duration", flags->duration_s, "How long to serve [s] (default: 0, until interrupted)")
      .from_to(0.0, 1e6);
  command.flag("--no-pace", flags->no_pace, "Do not limit a pseudo-terminal to its baud rate");
  constexpr int max_replies = 1'000'000'000;
  command.option("--inject-seed", flags->faults.seed, "Seed of the injected faults");
  command.option("--inject-late-ms", flags->late_ms, "Delay of a late reply [ms]").from_to(0.0, 1e5);
  command.option("--inject-late-every", flags->faults.late_every, "Delay one reply in N")
      .from_to(0, max_replies);
  command.option("--inject-drop-every", flags->faults.drop_every, "Drop one reply in N")
      .from_to(0, max_replies);
  command.option("--inject-corrupt-every", flags->faults.corrupt_every, "Flip one bit in one reply in N")
      .from_to(0, max_replies);
  command
      .option("--inject-stale-every", flags->faults.stale_every,
              "Repeat the previous reply instead of one reply in N")
      .from_to(0, max_replies);
  command
      .option("--inject-reorder-every", flags->faults.reorder_every, "Send one reply in N after the next one")
      .from_to(0, max_replies);
  const auto once = [&command](const char* name, double& after_s, const std::string& what) {
    command.option(name, after_s, what + " once, this many seconds after the controller takes over")
        .from_to(0.0, 1e6);
  };
  once("--inject-restart-after", flags->faults.restart_after_s, "Restart the device");
  once("--inject-cut-after", flags->faults.cut_after_s, "Cut the link");
  once("--inject-stick-after", flags->faults.stick_after_s, "Freeze an encoder");
  once("--inject-jump-after", flags->faults.jump_after_s, "Make the cart's counts jump");
  command.option("--inject-stick", flags->stuck_encoder, "Encoder that freezes (default: cart)")
      .one_of({"cart", "pendulum"});
  command.option("--inject-jump-counts", flags->faults.jump_counts, "Size of the jump [counts]");
  command.does([flags] {
    serve(*flags);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
