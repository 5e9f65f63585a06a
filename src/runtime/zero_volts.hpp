// The end of each run: the motor is set to zero volts, and the rig is polled until that is confirmed or
// the time is over.
#pragma once

#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/runtime/live_status.hpp"

namespace upright {

/// Time limit of a stop. Devices restart, and other masters release a device, within seconds.
inline constexpr double stop_patience_s = 10.0;

/// Stops the rig and waits until zero volts is confirmed, the time limit is reached, or `end_requests`
/// increases. Not for the loop's thread.
StopReport stop_and_wait(Rig& rig, Clock& clock, const StopWatcher& watcher);

}  // namespace upright
