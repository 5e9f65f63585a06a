#include "options.hpp"

#include <sched.h>

#include <cerrno>
#include <iostream>
#include <string>

namespace upright::cli {

namespace {

/// A processor that this process may run on.
std::string fault_of_processor(const std::string& text) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  sched_getaffinity(0, sizeof allowed, &allowed);
  std::string known;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &allowed)) continue;
    if (text == std::to_string(cpu)) return "";
    known += (known.empty() ? "" : ", ") + std::to_string(cpu);
  }
  return "this process is not allowed to run on processor " + text.substr(0, 40) + ": use one of " + known;
}

}  // namespace

void add_realtime(const Command& command, RealtimeRequest& realtime) {
  command.option("--priority", realtime.priority, "Real-time priority to request (default: 80)")
      .from_to(1, 99);
  command.option("--cpu", realtime.cpu, "Processor to pin the control loop to (default: the last one)")
      .without(fault_of_processor);
  constexpr double longest_spin_us = 1e4;
  command
      .option("--spin", realtime.spin_us,
              "Busy-wait for this long before each period instead of sleeping [us] (default: spin_us of the "
              "rig file)")
      .in(Range::within(0.0, longest_spin_us));
}

void add_simulated(const Command& command, std::optional<std::uint64_t>& seed, bool& fast) {
  command.option("--seed", seed, "Simulated rigs only: seed of noise and jitter (default: 1)");
  command.flag("--fast", fast, "Simulated rigs only: run in virtual time, as fast as the computer allows");
}

void finish_output() {
  errno = 0;
  std::cout.flush();
  if (std::cout || errno == EPIPE) return;
  throw DeviceError("cannot write to standard output: free some space where the output is stored");
}

}  // namespace upright::cli
