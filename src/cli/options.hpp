// What the commands share: the flags of real time and of simulated rigs, and the end of their output.
#pragma once

#include <cstdint>
#include <optional>

#include "command_line.hpp"
#include "runtime/realtime.hpp"

namespace upright::cli {

/// --priority and --cpu.
void add_realtime(const Command& command, RealtimeRequest& realtime);

/// --seed and --fast, of simulated rigs only.
void add_simulated(const Command& command, std::optional<std::uint64_t>& seed, bool& fast);

/// Flushes stdout; throws Error when the output did not arrive (a full disk), so that a script never takes a
/// cut document for a whole one. A reader that closed the pipe has had what it wanted.
void finish_output();

}  // namespace upright::cli
