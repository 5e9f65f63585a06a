#include <array>
#include <cstdio>

#include "hal/modbus_exception.hpp"

namespace upright {

namespace {

const char* meaning_of(int exception) {
  static constexpr std::array meanings = {
      "unknown",       "illegal function",     "illegal data address",
      "illegal value", "device failure",       "acknowledged, but not done yet",
      "device busy",   "negative acknowledge", "memory parity error",
      "unknown",       "gateway has no path",  "no answer from the device behind the gateway"};
  const auto at = static_cast<std::size_t>(exception);
  return exception > 0 && at < meanings.size() ? meanings[at] : meanings[0];
}

}  // namespace

std::string exception_text(int exception) {
  char number[16];
  std::snprintf(number, sizeof number, "%02X", static_cast<unsigned>(exception) & 0xffu);
  return std::string("exception ") + number + " (" + meaning_of(exception) + ")";
}

}  // namespace upright
