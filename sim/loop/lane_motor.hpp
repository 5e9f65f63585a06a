// The motor's lag by lane.
#pragma once

#include "lane_model.hpp"
#include "upright/sim/motor_lag.hpp"

namespace upright {

/// A motor without lag.
struct PromptMotor {
  explicit PromptMotor(const PlantModel<Lanes>& /*model*/) {}
  static constexpr bool lags() { return false; }
};

/// A motor that may lag.
class LaneMotor {
 public:
  explicit LaneMotor(const PlantModel<Lanes>& model)
      : lags_(Dynamics<Lanes>(model).has_motor_lag()),
        lag_s_(Dynamics<Lanes>(model).motor_time_constant_s()) {}

  /// False: the voltage at the motor is that of the drive.
  bool lags() const { return lags_; }
  Lanes time_constant_s() const { return lag_s_; }

  LaggedMotor<Lanes> over(const Lanes& motor_v, const Lanes& drive, const Lanes& length_s) const {
    const Lanes r = length_s / lag_s_, shortest(smooth_within_lags);
    const LaneMask slow = r < shortest;
    const LaggedMotor<Lanes> few = slowly_lagged_motor(motor_v, drive, r),
                             more = quickly_lagged_motor(motor_v, drive, larger(r, shortest));
    return {select(slow, few.begin_v, more.begin_v), select(slow, few.middle_v, more.middle_v),
            select(slow, few.end_v, more.end_v), select(slow, few.after_v, more.after_v)};
  }
  Lanes after(const Lanes& motor_v, const Lanes& drive, const Lanes& time_s) const {
    return drive + (motor_v - drive) * exp(-(time_s / lag_s_));
  }
  /// The longest step that shows how the motor nears its drive.
  Lanes longest_s(const Lanes& motor_v, const Lanes& drive, const Lanes& length_s) const {
    constexpr double settled_v = 1e-9;
    return select(absolute(motor_v - drive) > Lanes(settled_v), smaller(length_s, lag_s_), length_s);
  }

 private:
  bool lags_;
  Lanes lag_s_;
};

}  // namespace upright
