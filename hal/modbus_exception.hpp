// The exceptions that a Modbus device answers with, by number, as the protocol's specification names them.
#pragma once

#include <string>

namespace upright {

/// The device says: later. What it was asked for may succeed the next time (acknowledged, busy, and a gateway
/// whose device did not answer).
constexpr bool passes_by_itself(int exception) noexcept {
  return exception == 0x05 || exception == 0x06 || exception == 0x0A || exception == 0x0B;
}

/// "exception 06 (device busy)".
std::string exception_text(int exception);

}  // namespace upright
