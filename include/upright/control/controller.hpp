// The one control step, shared by run, replay, sweep and experiment: state estimates, delay, state
// feedback and limiter as a pure function of counts-in-SI and what came before. Allocates at construction
// only.
#pragma once

#include <cstdint>
#include <memory>

#include "upright/control/command_source.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/control/limiter.hpp"
#include "upright/control/state.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/control/velocity_estimator.hpp"

namespace upright {

/// One sample, already scaled and unwrapped.
struct ControlInput {
  std::uint64_t tick = 0;  ///< period number; grows. A gap means periods without a sample.
  double cart_m = 0.0;
  double theta_rad = 0.0;
  double reference_m = 0.0;  ///< set-point of the cart position
};

struct ControlOutput {
  ControlState state;  ///< what was measured and estimated now
  double voltage_requested_v = 0.0;
  double voltage_v = 0.0;  ///< after the limiter; zero when the request was not finite
  bool saturated = false;
  bool finite = true;
  Demand demand;          ///< what was asked for
  double lean_rad = 0.0;  ///< theta from the upright pose that is balanced about
};

class Controller {
 public:
  /// `amplifier_limit_v`: the limiter's. `parts`: those that the configuration asks for (`make_model_parts`).
  /// Throws ConfigError when the configuration cannot be run, or a part of it is missing.
  Controller(const ControlConfig& config, double amplifier_limit_v, ModelParts parts = {});

  /// From now on `source` says what to do; null: balance about zero. It must outlive the controller.
  void follow(CommandSource* source) noexcept { source_ = source; }
  bool is_scripted() const noexcept { return source_ != nullptr; }

  /// Forgets what came before: the next step begins from rest there.
  void reset() noexcept { started_ = false; }

  /// The voltage for a sample. Samples missing since the last step are predicted by a state estimator;
  /// without one they are taken as lying on the straight line between the two that are there. So estimates
  /// and delay keep their time; at most `most_missing_periods` of them, beyond which the controller begins
  /// anew from rest.
  ControlOutput step(const ControlInput& input) noexcept;

  const ControlConfig& config() const { return config_; }
  const DelayLine& delay_line() const { return delay_; }
  double amplifier_limit_v() const { return limit_v_; }

  static constexpr std::uint64_t most_missing_periods = 1000;

 private:
  void begin(const ControlInput& input) noexcept;
  double feedback(const Demand& demand) const noexcept;
  void advance_to(const ControlInput& input, std::uint64_t periods) noexcept;
  void advance(double cart_m, double theta_rad) noexcept;
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
