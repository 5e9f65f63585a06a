#include "options.hpp"

#include <cerrno>
#include <iostream>

namespace upright::cli {

void add_realtime(const Command& command, RealtimeRequest& realtime) {
  command.option("--priority", realtime.priority, "Real-time priority to ask for (80)").from_to(1, 99);
  command.option("--cpu", realtime.cpu, "Processor to stay on (the last one)").from_to(0, 1023);
}

void add_simulated(const Command& command, std::optional<std::uint64_t>& seed, bool& fast) {
  command.option("--seed", seed, "Of noise and jitter, simulated rigs only (1)");
  command.flag("--fast", fast, "Virtual time: as fast as it goes, simulated rigs only");
}

void finish_output() {
  errno = 0;
  std::cout.flush();
  if (std::cout || errno == EPIPE) return;
  throw DeviceError("free space where the output goes: stdout could not be written");
}

}  // namespace upright::cli
