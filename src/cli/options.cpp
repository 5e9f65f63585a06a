#include "options.hpp"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <iostream>
#include <string>

#include "upright/model/error.hpp"

namespace upright::cli {

CLI::Validator number_in(const Range& range) {
  const auto check = [range](std::string& text) {
    double value = 0.0;
    const char* end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, value);
    const bool good = result.ec == std::errc{} && result.ptr == end && std::isfinite(value);
    return good && range.contains(value) ? std::string() : "give it a number " + range.text();
  };
  return CLI::Validator(check, "");
}

void add_realtime(CLI::App& command, RealtimeRequest& realtime) {
  command.add_option("--priority", realtime.priority, "Real-time priority to ask for (80)")
      ->check(CLI::Range(1, 99));
  command.add_option("--cpu", realtime.cpu, "Processor to stay on (the last one)")
      ->check(CLI::Range(0, 1023));
}

void finish_output() {
  errno = 0;
  std::cout.flush();
  if (std::cout || errno == EPIPE) return;
  throw DeviceError("free space where the output goes: stdout could not be written");
}

}  // namespace upright::cli
