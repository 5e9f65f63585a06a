// What a predictor carries from period to period, for a generic scalar: a rig's controller, or many simulated
// loops side by side in SIMD lanes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "upright/control/gain_file.hpp"
#include "upright/model/scalar.hpp"

namespace upright {

/// States that a prediction carries: those of FilterState up to the force on the cart.
constexpr std::size_t predicted_states = 6;

/// A linear model over a fixed time: x := a x + b u + constant, with u after the static actuator chain.
struct PredictorStep {
  using Column = std::array<double, predicted_states>;
  std::array<Column, predicted_states> a{};  ///< by column
  Column b{}, constant{};

  /// `State` is indexed by FilterState.
  template <class S, class State>
  void propagate(State& state, const S& drive_v) const {
    const State moved = freely<predicted_states>(state);
    for (std::size_t row = 0; row < predicted_states; ++row)
      state[row] = (moved[row] + S(b[row]) * drive_v) + S(constant[row]);
  }

  /// a x of the first `states`, while the others are 0.
  template <std::size_t states, class State>
  State freely(const State& state) const {
    using S = typename State::value_type;
    State moved = state;
    for (std::size_t row = 0; row < states; ++row) {
      S sum = S(a[0][row]) * state[0];
      for (std::size_t j = 1; j < states; ++j) sum = sum + S(a[j][row]) * state[j];
      moved[row] = sum;
    }
    return moved;
  }

  /// What a volt over one period adds to the state so many periods later.
  Column of_a_volt(std::size_t periods_later) const {
    Column added = b;
    for (std::size_t i = 0; i < periods_later; ++i) added = freely<predicted_states>(added);
    return added;
  }
};

/// From the matrices of a model with its states in the order of FilterState; others than the predicted are
/// left out.
template <class Matrix, class Vector>
PredictorStep predictor_step(const Matrix& a, const Vector& b, const Vector& constant) {
  PredictorStep step;
  const auto states = std::min<std::ptrdiff_t>(b.size(), predicted_states);
  for (std::ptrdiff_t i = 0; i < states; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (std::ptrdiff_t j = 0; j < states; ++j) step.a[static_cast<std::size_t>(j)][at] = a(i, j);
    step.b[at] = b(i);
    step.constant[at] = constant(i);
  }
  return step;
}

/// The voltages before the measurement, filtered as the positions are for their velocities (predictor.hpp).
struct VoltageFilter {
  double m1 = 0.0, m0 = 0.0, motor_decay = 0.0, motor_gain = 0.0;

  template <class S>
  struct State {
    S now{}, next{}, motor{};
  };

  template <class S>
  State<S> started(const S& drive_v) const {
    const S settled = drive_v / S(1.0 + m1 + m0);
    return {settled, settled, motor_gain == 0.0 ? S(0.0) : settled};
  }
  template <class S>
  void take(State<S>& filtered, const S& drive_v) const {
    filtered.motor = S(motor_decay) * filtered.motor + S(motor_gain) * filtered.now;
    const S next = drive_v - S(m1) * filtered.next - S(m0) * filtered.now;
    filtered.now = filtered.next;
    filtered.next = next;
  }
};

/// What a feedback of the predicted state amounts to: V = constant + known . x(delayed) + now, next, motor .
/// filtered voltages + sum of on_their_way . voltages after the static chain. In the first `free_periods`
/// after the start, V = freely_constant + freely . x with x from the start by `lead`, then `step` each
/// period.
struct FeedbackPrediction {
  using Row = std::array<double, predicted_states>;
  Row known{};  ///< of the true states
  double constant_v = 0.0;
  double now = 0.0, next = 0.0, motor = 0.0;
  std::vector<double> on_their_way;  ///< oldest first
  /// What a volt as old as the oldest would add to the predicted state, had it acted over the whole period.
  PredictorStep::Column leaving{};
  /// Of a period, by which the oldest voltage acts longer than whole periods.
  double fraction = 0.0;
  std::size_t free_periods = 0;
  Row freely{};
  double freely_constant_v = 0.0;

  PredictorStep step, lead;
  VoltageFilter filter;
  bool lags = false;                                ///< the motor's voltage is a state
  std::array<double, 2> scale{1.0, 1.0}, offset{};  ///< the sensors show scale x + offset, cart and pendulum
};

/// Of a feedback, by state.
inline FeedbackPrediction::Row row_of(const Gains& gains) {
  return {gains.cart_position_v_per_m, gains.pendulum_angle_v_per_rad, gains.cart_velocity_v_per_mps,
          gains.pendulum_rate_v_per_radps};
}

}  // namespace upright
