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
  return "this process may not run on processor " + text.substr(0, 40) + ", only on " + known;
}

}  // namespace

void add_realtime(const Command& command, RealtimeRequest& realtime) {
  command.option("--priority", realtime.priority, "Real-time priority to ask for (80)").from_to(1, 99);
  command.option("--cpu", realtime.cpu, "Processor to stay on (the last one)").without(fault_of_processor);
  constexpr double longest_spin_us = 1e4;
  command
      .option("--spin", realtime.spin_us,
              "End of each period's wait to spend awake [us], in place of the rig file's spin_us")
      .in(Range::within(0.0, longest_spin_us));
}

void add_simulated(const Command& command, std::optional<std::uint64_t>& seed, bool& fast) {
  command.option("--seed", seed, "Of noise and jitter, simulated rigs only (1)");
  command.flag("--fast", fast, "Virtual time: as fast as it goes, simulated rigs only");
}

void finish_output() {
  errno = 0;
  std::cout.flush();
  if (std::cout || errno == EPIPE) return;
  throw DeviceError("stdout could not be written: free space where the output goes");
}

}  // namespace upright::cli
