// What the commands' flags share.
#pragma once

#include <CLI/CLI.hpp>

#include "upright/model/yaml_reader.hpp"
#include "upright/runtime/realtime.hpp"

namespace upright::cli {

/// A flag's value must be a finite number in `range`. (CLI11 alone accepts nan, inf and hexadecimal.)
CLI::Validator number_in(const Range& range);

/// --priority and --cpu.
void add_realtime(CLI::App& command, RealtimeRequest& realtime);

/// Flushes stdout; throws Error when the output did not arrive (a full disk), so that a script never takes a
/// cut document for a whole one. A reader that closed the pipe has had what it wanted.
void finish_output();

}  // namespace upright::cli
