// What commands that drive a rig share: signals that end a run at zero volts, and how the command was typed.
#pragma once

#include <string>

#include "runtime/control_loop.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright::cli {

/// SIGINT, SIGTERM, SIGHUP, SIGQUIT and SIGTSTP (Ctrl-C, Ctrl-\, Ctrl-Z) from now on set the flag that is
/// returned, and end or suspend nothing by themselves: a process that stands still leaves the last voltage
/// on. SIGTTIN and SIGTTOU, which would suspend it in the background, are ignored.
const SignalFlag& catch_signals();

/// For commands that compute. From now on SIGINT and SIGTERM end the program with exit code 3 and a sentence
/// that says so, until `answer_on_signal`.
void end_on_signal();
/// There is an answer to give from now on: the first SIGINT or SIGTERM sets the flag that is returned, and
/// the second one ends the program at once.
const SignalFlag& answer_on_signal();

/// How often somebody has asked for the end by SIGINT, SIGTERM or SIGQUIT. A terminal that goes away does not
/// count: it may say so more than once.
unsigned end_requests() noexcept;

/// Ends a run as a signal does: what the live page's stop button calls, from any thread.
/// Only after `catch_signals`.
void press_stop_button() noexcept;

/// The command as it was typed.
std::string command_line();

}  // namespace upright::cli
