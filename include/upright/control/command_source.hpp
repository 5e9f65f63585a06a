// The demand on the control step in one period: feedback about a set-point, or a given voltage. `run` has
// no command source and always balances. The script of an experiment is a command source.
#pragma once

#include <cstdint>

#include "upright/control/state.hpp"

namespace upright {

/// What the control step does in one period.
struct Demand {
  bool feedback = true;        ///< state feedback about the reference; false: `voltage_v` is applied directly
  double reference_m = 0.0;    ///< set-point of the cart [m]
  double reference_rad = 0.0;  ///< the upright angle about which feedback acts: a multiple of 2 pi [rad]
  double voltage_v = 0.0;      ///< without feedback: the voltage [V], before the limiter
  bool homing = false;         ///< moving to the start position: the cart may begin beyond the track limit
  bool over = false;           ///< nothing more to do: the run is complete with this period
  bool timed_out = false;      ///< an awaited condition did not occur in time: the run stops
};

/// Called once per computed period, in the loop: no allocation, no lock, no exception. Equal inputs give
/// bit-identical demands, so that a log can be replayed.
class CommandSource {
 public:
  virtual ~CommandSource() = default;
  /// `now`: measured positions and estimated velocities of this period.
  virtual Demand next(std::uint64_t tick, const ControlState& now) noexcept = 0;
};

}  // namespace upright
