// What a piece's script knows of the rig, and the servo that moves the cart between and within stretches.
#pragma once

#include "servo_model.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/control/state.hpp"

namespace upright {

/// Limits of a piece and what it starts from.
struct ScriptContext {
  double period_s = 1e-3;
  double travel_m = 0.3;
  double voltage_limit_v = 10.0;
  ServoModel servo;
  Gains gains;  ///< of the feedback that catches after a swing-up

  /// Where a stretch that goes to one side of the track may begin.
  double side_m() const noexcept;
};

constexpr double standing_mps = 0.003;  ///< below it the cart stands
constexpr double rest_radps = 0.25;     ///< below it the pendulum is at rest
/// Speed asked for per distance that is missing.
constexpr double approach_per_s = 3.0;

/// The direction of a velocity or force: -1 or 1, never 0.
inline double sign(double value) noexcept {
  return value < 0.0 ? -1.0 : 1.0;
}

/// An angle within half a turn of zero.
double wrapped(double angle_rad) noexcept;

/// The pendulum's angle from hanging; 0 without a pendulum.
double hanging_lean(const ScriptContext& context, const ControlState& now) noexcept;

/// The pendulum hangs and does not swing.
bool hangs_still(const ScriptContext& context, const ControlState& now) noexcept;

/// Where the cart would stand if it were stopped now, braking with a part of the voltage.
double stop_position_m(const ScriptContext& context, const ControlState& now) noexcept;

/// Gives the cart a velocity.
class CartServo {
 public:
  explicit CartServo(const ServoModel& model) : model_(model) {}

  /// `elapsed_s`: since it was last asked.
  double voltage_v(double speed_mps, const ControlState& now, double elapsed_s) noexcept;
  /// Forgets the push that has grown where the cart sticks.
  void reset() noexcept { push_v_ = 0.0; }

 private:
  ServoModel model_;
  double push_v_ = 0.0;  ///< its integral part
};

}  // namespace upright
