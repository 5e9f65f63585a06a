// The end of every run: the motor is brought to zero volts, for as long as it takes to know, and what is
// known is said.
#pragma once

#include <functional>

#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"

namespace upright {

/// How long a stop is tried for at most. Devices restart, and other masters let go, within seconds.
inline constexpr double stop_patience_s = 10.0;

/// Who waits for a stop. Each may be empty.
struct StopWatcher {
  /// How often somebody has asked for the end so far (Ctrl-C): once more ends the trying.
  std::function<unsigned()> end_requests;
  /// Called about once per second as long as zero volts is not confirmed, with the time that is left.
  std::function<void(const StopReport&, double left_s)> trying;
};

/// Stops the rig and waits until zero volts is confirmed, the patience is over, or somebody asks for the end
/// once more. Not from the loop's thread.
StopReport stop_and_wait(Rig& rig, Clock& clock, const StopWatcher& watcher);

}  // namespace upright
