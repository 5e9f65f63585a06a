// Examination of a rig with its motor off: the link's speed, the zero, the signs of the encoders. No
// function writes a voltage; the rig is open and stays at zero volts.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "finding.hpp"
#include "runtime/control_loop.hpp"
#include "upright/hal/calibration.hpp"
#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/wiring.hpp"
#include "upright/record/timing_stats.hpp"

namespace upright {

struct LinkProbe {
  DurationHistogram round_trip;  ///< of successful readings
  std::uint64_t failed = 0;
  /// Readings refused because of an active input, which are no fault of the link.
  std::uint64_t emergency_stops = 0, limit_switches = 0;
  std::vector<EncoderCounts> counts;  ///< of the last second
  /// Of a device that is the clock, whose samples make no round trips; none: the computer is the clock.
  std::optional<DeviceTiming> device_clock;
};

/// Reads at `rate_hz` for `duration_s`, or until a signal. A device that is the clock was opened with this
/// rate.
LinkProbe probe_link(Rig& rig, Clock& clock, double rate_hz, double duration_s, const SignalFlag& signal);

/// The rate at which 99 % of the periods have time for their two exchanges, reading and writing [Hz]. A
/// single slow exchange has no effect.
double highest_rate_hz(const DurationHistogram& round_trip);

Finding judge_link(const LinkProbe& probe, double rate_hz);

/// The verdict of doctor in one sentence, for the examined rate `rate_hz`. If the link supports only a
/// lower rate, the sentence states it. Without a link `round_trip` is null.
std::string verdict_sentence(Health verdict, double rate_hz, const DurationHistogram* round_trip);

/// Checks the zero of the calibration against a pendulum that hangs at rest. The remedy has the correct
/// counts.
Finding judge_zero(const std::vector<EncoderCounts>& counts, const Calibration& calibration);

/// Motions that an operator is asked to make with the motor off.
enum class HandMove : std::uint8_t {
  cart_to_plus,  ///< push the cart toward +x
  bob_to_plus,   ///< lift the hanging pendulum's bob toward +x
};

/// The result of a motion so far.
enum class HandAnswer : std::uint8_t { nothing_yet, agrees, opposes };

/// Observes the pose from the time of the request on.
class HandTest {
 public:
  HandTest(HandMove move, const Pose& start) : move_(move), start_(start) {}
  HandAnswer look(const Pose& now) const;

 private:
  HandMove move_;
  Pose start_;
};

/// Requests both motions, each for up to `patience_s`. `ask` shows a text to the operator.
std::vector<Finding> examine_signs_by_hand(Rig& rig, Clock& clock, const Calibration& calibration,
                                           double patience_s, const SignalFlag& signal,
                                           const std::function<void(const std::string&)>& ask);

/// The safety inputs that a rig lacks, and the remedy.
std::vector<Finding> name_missing_inputs(const SafetyInputs& inputs);

/// The observations of the wired inputs during the probe of the link.
std::vector<Finding> judge_safety_inputs(const SafetyInputs& inputs, const LinkProbe& probe);

/// Whether the inputs of a rig without a link were read each time.
Finding judge_lines(const LinkProbe& probe);

/// The lines that the program drives. An open rig keeps them off; only a person can see what they switch.
std::vector<Finding> name_driven_lines(const GpioRig& gpio);

/// Requests to press the emergency stop and to trip each limit switch, and to release each again, for up
/// to `patience_s` each. Inputs that are not wired are skipped.
std::vector<Finding> examine_safety_inputs_by_hand(Rig& rig, Clock& clock, double patience_s,
                                                   const SignalFlag& signal,
                                                   const std::function<void(const std::string&)>& ask);

}  // namespace upright
