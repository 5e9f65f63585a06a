// One instance of an FMU: the plant with the event engine, its input and its parameters.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "fmu_variables.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {

/// Copies are complete states, from which the motion goes on with the same bits.
class FmuInstance {
 public:
  explicit FmuInstance(const FmuPlant& plant) : plant_(plant) {}

  /// The parameters may be changed until the start.
  FmuPlant& plant() { return plant_; }
  bool has_started() const { return simulator_.has_value(); }
  double voltage_v() const { return voltage_v_; }
  void set_voltage(double voltage_v) { voltage_v_ = voltage_v; }

  void set_start_time(double time_s) { start_s_ = time_s; }

  /// From the initial state, at the start time, with the motor at zero volts until the first step.
  void start() {
    simulator_.emplace(make_model<double>(plant_.plant));
    PlantState<double> state;
    state.cart_m = plant_.cart_m;
    state.theta_rad = plant_.theta_rad;
    state.cart_mps = plant_.cart_velocity_mps;
    state.theta_radps = plant_.pendulum_rate_radps;
    simulator_->start(state);
  }

  /// The voltage acts from `from_s` on and is held until `to_s`.
  void step(double from_s, double to_s) {
    simulator_->command(since_start_s(from_s), voltage_v_);
    simulator_->advance_to(since_start_s(to_s));
  }

  double output(FmuOutput which) const {
    const EventEngine<double>& engine = simulator_->engine();
    const PlantState<double>& state = engine.state();
    switch (which) {
      case FmuOutput::cart_m:
        return engine.outputs().cart_m;
      case FmuOutput::theta_rad:
        return engine.outputs().theta_rad;
      case FmuOutput::cart_velocity_mps:
        return state.cart_mps;
      case FmuOutput::pendulum_rate_radps:
        return state.theta_radps;
      case FmuOutput::motor_force_n:
        return engine.dynamics().motor_force(state, state.motor_v);
      case FmuOutput::other_force_n:
        return force_on_cart_n() - engine.dynamics().motor_force(state, state.motor_v);
    }
    return 0.0;
  }

 private:
  /// Importers add up steps; a run counts nanoseconds. Rounded to these, both have the same times.
  double since_start_s(double time_s) const {
    constexpr double ns_per_s = 1e9;
    return static_cast<double>(std::llround((time_s - start_s_) * ns_per_s)) / ns_per_s;
  }

  /// All forces on the cart but the pendulum's reaction: what its acceleration takes.
  double force_on_cart_n() const {
    const EventEngine<double>& engine = simulator_->engine();
    const PlantState<double>& state = engine.state();
    const PlantState<double> rate = engine.dynamics().derivative(state, state.motor_v, engine.contacts());
    const BaseParameters<double>& base = engine.dynamics().base();
    if (!engine.dynamics().has_pendulum()) return base.cart_mass_kg * rate.cart_mps;
    const auto [s, c] = elementary::sine_and_cosine(state.theta_rad);
    return (base.cart_mass_kg + base.pendulum_mass_kg) * rate.cart_mps +
           base.pendulum_mass_kg * base.length_to_com_m *
               (c * rate.theta_radps - s * state.theta_radps * state.theta_radps);
  }

  FmuPlant plant_;
  std::optional<Simulator<double>> simulator_;
  double voltage_v_ = 0.0, start_s_ = 0.0;
};

}  // namespace upright
