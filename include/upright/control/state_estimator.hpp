// What turns counts and voltages into the state that is fed back, where a gain file asks for a model.
#pragma once

#include <memory>

#include "upright/control/state.hpp"

namespace upright {

/// Called in the loop: no allocation, no lock, no exception, bounded work. The same inputs give the same
/// states, bit for bit.
class StateEstimator {
 public:
  virtual ~StateEstimator() = default;
  /// Begins at rest where the sensors show the body.
  virtual void start(double cart_m, double theta_rad) noexcept = 0;
  /// One period later: what the sensors show now. `applied_v`: the voltage commanded over the period that
  /// just ended, after the amplifier's limit.
  virtual ControlState update(double cart_m, double theta_rad, double applied_v) noexcept = 0;
  /// One period later, without a reading.
  virtual ControlState predict(double applied_v) noexcept = 0;
  /// The voltage that takes away the force that is known and estimated, at an estimate of `update`.
  virtual double rejecting_v(const ControlState& estimate) const noexcept = 0;
  /// The command that leaves `wanted_v` behind a dead zone that its plant file has.
  virtual double command_v(double wanted_v) const noexcept = 0;
};

/// Makes up for the delay: turns the delayed state into an estimate of the present one. Called once per
/// period, in the loop: no allocation, no lock, no exception.
class DelayCompensator {
 public:
  virtual ~DelayCompensator() = default;
  /// Begins from rest at `state`, which has held for ever.
  virtual void start(const ControlState& state) noexcept = 0;
  /// `delayed`: the state one delay ago. `applied_v`: the voltage that was held over the period that just
  /// ended.
  virtual ControlState compensate(const ControlState& delayed, double applied_v) noexcept = 0;
};

/// The parts of a controller that need a plant file.
struct ModelParts {
  ModelParts() = default;
  template <class Compensator>
  requires std::is_convertible_v<std::unique_ptr<Compensator>, std::unique_ptr<DelayCompensator>> ModelParts(
      std::unique_ptr<Compensator> of)
      : compensator(std::move(of)) {}
  ModelParts(std::nullptr_t) {}

  std::unique_ptr<StateEstimator> estimator;
  std::unique_ptr<DelayCompensator> compensator;
};

}  // namespace upright
