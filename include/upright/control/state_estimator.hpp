// Model-based estimation of the state for feedback, where a gain file requires it.
#pragma once

#include <memory>

#include "upright/control/state.hpp"

namespace upright {

/// Called in the loop: no allocation, no lock, no exception, bounded work. Equal inputs give
/// bit-identical states.
class StateEstimator {
 public:
  virtual ~StateEstimator() = default;
  /// Starts at rest at the measured position and angle.
  virtual void start(double cart_m, double theta_rad) noexcept = 0;
  /// Advances by one period and updates with the sensors' present values. `applied_v`: the voltage
  /// commanded over the period that just ended, after the amplifier's limit.
  virtual ControlState update(double cart_m, double theta_rad, double applied_v) noexcept = 0;
  /// Advances by one period without a measurement.
  virtual ControlState predict(double applied_v) noexcept = 0;
  /// The voltage that cancels the known and the estimated force, given an estimate of `update`.
  virtual double rejecting_v(const ControlState& estimate) const noexcept = 0;
  /// The command that yields `wanted_v` after the dead zone of the plant file.
  virtual double command_v(double wanted_v) const noexcept = 0;
};

/// Compensates the delay: estimates the present state from the delayed one. Called once per period, in
/// the loop: no allocation, no lock, no exception.
class DelayCompensator {
 public:
  virtual ~DelayCompensator() = default;
  /// Starts at rest at `state`, with that state as constant history.
  virtual void start(const ControlState& state) noexcept = 0;
  /// `delayed`: the state one delay ago. `applied_v`: the voltage held over the period that just
  /// ended.
  virtual ControlState compensate(const ControlState& delayed, double applied_v) noexcept = 0;
};

/// The parts of a controller that need a plant file.
struct ModelParts {
  ModelParts() = default;
  /// A compensator alone.
  template <class Compensator>
  requires std::is_convertible_v<std::unique_ptr<Compensator>, std::unique_ptr<DelayCompensator>> ModelParts(
      std::unique_ptr<Compensator> of)
      : compensator(std::move(of)) {}
  ModelParts(std::nullptr_t) {}  ///< no parts

  std::unique_ptr<StateEstimator> estimator;      ///< null: the velocity estimator is used
  std::unique_ptr<DelayCompensator> compensator;  ///< null: the delay is not compensated
};

}  // namespace upright
