// What the commands' flags share.
#pragma once

#include <CLI/CLI.hpp>

#include "upright/model/yaml_reader.hpp"

namespace upright::cli {

/// A flag's value must be a finite number in `range`. (CLI11 alone accepts nan, inf and hexadecimal.)
CLI::Validator number_in(const Range& range);

/// Flushes stdout; throws Error when the output did not arrive (a full disk), so that a script never takes a
/// cut document for a whole one. A reader that closed the pipe has had what it wanted.
void finish_output();

}  // namespace upright::cli
