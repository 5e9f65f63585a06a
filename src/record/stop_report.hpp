// Descriptions of a stop: whether the motor is known to be at zero volts.
#pragma once

#include <string>

#include "upright/hal/rig.hpp"

namespace upright {

/// "confirmed" or "not_confirmed".
const char* name_of_zero(const StopReport& report) noexcept;

/// The state in one sentence; in capitals and with the remedy where a person must act.
std::string sentence_of(const StopReport& report);

/// Why zero volts is not confirmed yet: "no reply in time", "exception 06 (device busy)", ...
std::string reason_of(const StopReport& report);

/// Calls see(name, fact) for each fact of a stop, as in run.yaml and --json.
template <class See>
void for_each_fact(const StopReport& report, See&& see) {
  see("zero_volts", name_of_zero(report));
  see("zero_volts_read_back", report.read_back);
  see("amplifier_disabled", report.disabled);
  see("zero_volts_sentence", sentence_of(report));
}

}  // namespace upright
