// What commands that drive a rig share: signals that end a run at zero volts, and how the command was typed.
#pragma once

#include <string>

#include "upright/hal/rig_file.hpp"
#include "upright/runtime/control_loop.hpp"

namespace upright::cli {

/// SIGINT, SIGTERM and SIGHUP from now on set the flag that is returned, and end nothing by themselves.
const SignalFlag& catch_signals();

/// Ends a run as a signal does: what the live page's stop button calls, from any thread.
/// Only after `catch_signals`.
void press_stop_button() noexcept;

/// The command as it was typed.
std::string command_line();

}  // namespace upright::cli
