// What can be found out about a rig with its motor off: the link's speed, the zero, the signs of the
// encoders. Nothing here writes a voltage; the rig is open and stays at zero volts.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "finding.hpp"
#include "upright/hal/calibration.hpp"
#include "upright/hal/clock.hpp"
#include "upright/hal/gpio.hpp"
#include "upright/hal/rig.hpp"
#include "upright/record/timing_stats.hpp"
#include "upright/runtime/control_loop.hpp"

namespace upright {

struct LinkProbe {
  DurationHistogram round_trip;  ///< of readings that came
  std::uint64_t failed = 0;
  /// Readings that an active input refused: no fault of the link.
  std::uint64_t emergency_stops = 0, limit_switches = 0;
  std::vector<EncoderCounts> counts;  ///< of the last second
};

/// Reads at `rate_hz` for `duration_s`, or until a signal.
LinkProbe probe_link(Rig& rig, Clock& clock, double rate_hz, double duration_s, const SignalFlag& signal);

/// The rate at which 99 % of the periods have time for their two exchanges, reading and writing [Hz]. One
/// slow exchange never decides it.
double highest_rate_hz(const DurationHistogram& round_trip);

Finding judge_link(const LinkProbe& probe, double rate_hz);

/// The doctor's verdict in one sentence. It is about `rate_hz`, the rate that was examined: where the link
/// carries less, it says how much. Without a link `round_trip` is null.
std::string verdict_sentence(Health verdict, double rate_hz, const DurationHistogram* round_trip);

/// The pendulum hangs at rest: is that what the calibration says? If not, the remedy has the counts to put
/// in.
Finding judge_zero(const std::vector<EncoderCounts>& counts, const Calibration& calibration);

/// What an operator is asked to do with the motor off.
enum class HandMove : std::uint8_t {
  cart_to_plus,  ///< push the cart toward +x
  bob_to_plus,   ///< lift the hanging pendulum's bob toward +x
};

/// What a move has shown so far.
enum class HandAnswer : std::uint8_t { nothing_yet, agrees, opposes };

/// Watches the pose from the moment a move was asked for.
class HandTest {
 public:
  HandTest(HandMove move, const Pose& start) : move_(move), start_(start) {}
  HandAnswer look(const Pose& now) const;

 private:
  HandMove move_;
  Pose start_;
};

/// Asks for both moves, each with `patience_s`. `ask` shows the words to the operator.
std::vector<Finding> examine_signs_by_hand(Rig& rig, Clock& clock, const Calibration& calibration,
                                           double patience_s, const SignalFlag& signal,
                                           const std::function<void(const std::string&)>& ask);

/// Which inputs a rig does not have, and what to do about it.
std::vector<Finding> name_missing_inputs(const SafetyInputs& inputs);

/// What those that are wired showed while the link was probed.
std::vector<Finding> judge_safety_inputs(const SafetyInputs& inputs, const LinkProbe& probe);

/// Whether the inputs of a rig without a link could be read each time.
Finding judge_lines(const LinkProbe& probe);

/// The lines that the program drives. An open rig holds them, off; what hangs on them only a person can see.
std::vector<Finding> name_driven_lines(const GpioRig& gpio);

/// Asks to press the emergency stop and to trip each limit switch, and to release each again, each with
/// `patience_s`: was it seen? Those that are not wired are left out.
std::vector<Finding> examine_safety_inputs_by_hand(Rig& rig, Clock& clock, double patience_s,
                                                   const SignalFlag& signal,
                                                   const std::function<void(const std::string&)>& ask);

}  // namespace upright
