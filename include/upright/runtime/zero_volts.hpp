// The end of each run: the motor is set to zero volts, and the rig is polled until that is confirmed or
// the time is over.
#pragma once

#include <functional>

#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"

namespace upright {

/// Time limit of a stop. Devices restart, and other masters release a device, within seconds.
inline constexpr double stop_patience_s = 10.0;

/// Callbacks during a stop. Each may be empty.
struct StopWatcher {
  /// Number of requests so far to end the waiting (Ctrl-C). One more request ends it.
  std::function<unsigned()> end_requests;
  /// Called about once per second while zero volts is not confirmed, with the remaining time.
  std::function<void(const StopReport&, double left_s)> trying;
};

/// Stops the rig and waits until zero volts is confirmed, the time limit is reached, or `end_requests`
/// increases. Not for the loop's thread.
StopReport stop_and_wait(Rig& rig, Clock& clock, const StopWatcher& watcher);

}  // namespace upright
