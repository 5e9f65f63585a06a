// A rig's pendulum hangs until somebody lifts it: the wait, at zero volts, before the loop takes over.
#pragma once

#include <cstdint>
#include <functional>

#include "control_loop.hpp"
#include "upright/hal/calibration.hpp"
#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// What the operator is shown while the loop waits.
struct WaitStatus {
  Pose pose;
  std::int64_t cart_counts = 0;
  std::int64_t pendulum_counts = 0;
  double left_s = 0.0;  ///< until the wait is given up
};

struct WaitOptions {
  double patience_s = 30.0;
  /// Called about five times per second from the calling thread; may be empty.
  std::function<void(const WaitStatus&)> show;
};

/// Returns at once when the pendulum is within the fall angle and the cart within the track. Otherwise reads
/// the rig, which stays at zero volts, until both are and the pendulum is held nearly upright and still for
/// half a second; or until `patience_s` is over, a signal came, or the link failed for two seconds, which the
/// loop will then name. Returns how long it waited, in seconds. The rig is open and its zero known.
double wait_upright(Rig& rig, Clock& clock, const RigFile& file, const SignalFlag& signal,
                    const WaitOptions& options);

}  // namespace upright
