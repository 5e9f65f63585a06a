// What the control step is asked to do in a period: balance about a set-point, or put out a voltage. `run`
// has none and always balances; an experiment's script is one.
#pragma once

#include <cstdint>

#include "upright/control/state.hpp"

namespace upright {

struct Demand {
  bool feedback = true;        ///< state feedback about the reference; false: `voltage_v` as it is
  double reference_m = 0.0;    ///< set-point of the cart
  double reference_rad = 0.0;  ///< whole turns at which the pendulum is upright
  double voltage_v = 0.0;
  bool homing = false;     ///< on its way to where it starts: the cart may begin beyond the track limit
  bool over = false;       ///< there is nothing more to do: the run is complete with this period
  bool timed_out = false;  ///< what was waited for did not come: the run stops
};

/// Called once per computed period, in the loop: no allocation, no lock, no exception. The same inputs give
/// the same demands, bit for bit, so that a log replays.
class CommandSource {
 public:
  virtual ~CommandSource() = default;
  /// `now`: measured positions and estimated velocities of this period.
  virtual Demand next(std::uint64_t tick, const ControlState& now) noexcept = 0;
};

}  // namespace upright
