// What the commands share: the flags of real time, and the end of their output.
#pragma once

#include "command_line.hpp"
#include "upright/runtime/realtime.hpp"

namespace upright::cli {

/// --priority and --cpu.
void add_realtime(const Command& command, RealtimeRequest& realtime);

/// Flushes stdout; throws Error when the output did not arrive (a full disk), so that a script never takes a
/// cut document for a whole one. A reader that closed the pipe has had what it wanted.
void finish_output();

}  // namespace upright::cli
