#include "stop_report.hpp"

#include "hal/modbus_exception.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

std::string watchdog_words(const StopReport& report) {
  if (report.watchdog_s <= 0.0) return "; the device has no watchdog that would switch the voltage off";
  return "; the device's own watchdog, " +
         std::string(report.watchdog_read_back ? "set and read back" : "set but not read back") +
         " before the run, switches the voltage off " + exact_text(report.watchdog_s) +
         " s after the last request that it received";
}

}  // namespace

const char* name_of_zero(const StopReport& report) noexcept {
  return report.zero_confirmed ? "confirmed" : "not_confirmed";
}

std::string reason_of(const StopReport& report) {
  switch (report.fault) {
    case RigFault::none:
      return "no answer has come yet";
    case RigFault::link_timeout:
      return "no reply came in time";
    case RigFault::link_lost:
      return "there is no connection";
    case RigFault::corrupt_reply:
      return "the replies do not match the requests";
    case RigFault::device_refused:
      return report.exception == 0 ? "the device refused"
                                   : "the device refused with " + exception_text(report.exception);
    case RigFault::device_busy:
      return "the device answered with " + exception_text(report.exception);
    case RigFault::output_kept:
      return "the device acknowledged the request, but its output reads back unchanged";
    case RigFault::line_failed:
      return "a digital line could not be set";
    default:
      return "the device has a fault";
  }
}

std::string sentence_of(const StopReport& report) {
  if (report.done())
    return report.read_back ? "zero volts is confirmed: the device's output was read back"
                            : "zero volts is confirmed: the device acknowledged it";
  if (report.zero_confirmed)
    return "THE AMPLIFIER COULD NOT BE DISABLED: switch the amplifier off (zero volts is confirmed; "
           "disabling failed: " +
           reason_of(report) + ")";
  return "ZERO VOLTS COULD NOT BE CONFIRMED: switch the amplifier off (" + reason_of(report) +
         watchdog_words(report) + ")";
}

}  // namespace upright
