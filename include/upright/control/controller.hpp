// The control step shared by run, replay, sweep and experiment: state estimation, delay, state feedback
// and limiter. The output is a deterministic function of the present sample and the earlier ones. Memory
// is allocated at construction only.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>

#include "upright/control/command_source.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/control/state.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/control/velocity_estimator.hpp"

namespace upright {

/// One sample in SI units, unwrapped.
struct ControlInput {
  std::uint64_t tick = 0;    ///< period number; increasing. A gap means periods without a sample.
  double cart_m = 0.0;       ///< position of the cart [m]
  double theta_rad = 0.0;    ///< angle of the pendulum [rad]
  double reference_m = 0.0;  ///< set-point of the cart position [m]
  /// Velocities as the rig's device measures them, used if the gain file asks for them
  /// (EstimatorKind::device). Not a number: not measured.
  double cart_velocity_mps = std::numeric_limits<double>::quiet_NaN();
  double pendulum_rate_radps = std::numeric_limits<double>::quiet_NaN();  ///< the same of the pendulum
};

/// What the control step computed.
struct ControlOutput {
  ControlState state;                ///< measured positions and estimated velocities
  double voltage_requested_v = 0.0;  ///< before the limiter [V]
  double voltage_v = 0.0;            ///< after the limiter; zero when the request was not finite
  bool saturated = false;            ///< the limiter changed the voltage
  bool finite = true;                ///< false: the request was not a finite number
  Demand demand;                     ///< the demand of the command source
  double lean_rad = 0.0;             ///< theta relative to the upright angle about which feedback acts [rad]
};

/// The control step with its memory.
class Controller {
 public:
  /// `amplifier_limit_v`: limit of the voltage. `parts`: those that the configuration requires
  /// (`make_model_parts`). Throws ConfigError when the configuration is invalid or a part is missing.
  Controller(const ControlConfig& config, double amplifier_limit_v, ModelParts parts = {});

  /// From now on, demands come from `source`; null: balance about zero. It must outlive the controller.
  void follow(CommandSource* source) noexcept { source_ = source; }
  /// Whether demands come from a command source.
  bool is_scripted() const noexcept { return source_ != nullptr; }

  /// Discards all history: the next step starts from rest at its sample.
  void reset() noexcept { started_ = false; }

  /// The voltage for a sample. A state estimator predicts through samples that are missing since the
  /// last step. Without one they are interpolated linearly between the samples on both sides. At most
  /// `max_missing_periods` are bridged in this way; after a longer gap the controller restarts from
  /// rest.
  ControlOutput step(const ControlInput& input) noexcept;

  const ControlConfig& config() const { return config_; }  ///< the gain file's contents
  const DelayLine& delay_line() const { return delay_; }   ///< the delay of the feedback
  double amplifier_limit_v() const { return limit_v_; }    ///< the limit of the voltage [V]

  static constexpr std::uint64_t max_missing_periods = 1000;  ///< the longest gap that is bridged [periods]

 private:
  void begin(const ControlInput& input) noexcept;
  double feedback(const Demand& demand) const noexcept;
  void advance_to(const ControlInput& input, std::uint64_t periods) noexcept;
  void advance(const ControlInput& input) noexcept;
  double velocity(VelocityEstimator& estimator, double position, double measured) const noexcept;
  void act_on(const ControlState& newest) noexcept;

  ControlConfig config_;
  double limit_v_;
  VelocityEstimator cart_, pendulum_;
  DelayLine delay_;
  ModelParts parts_;
  CommandSource* source_ = nullptr;
  ControlState state_, acting_;
  std::uint64_t tick_ = 0;
  double voltage_v_ = 0.0;
  bool started_ = false;
};

}  // namespace upright
