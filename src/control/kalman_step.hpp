// The step of the stationary Kalman filter for a generic scalar: a rig's controller, or many simulated loops
// side by side in SIMD lanes.
#pragma once

#include <array>
#include <cstddef>

#include "upright/model/scalar.hpp"

namespace upright {

/// Index of a state.
enum FilterState : std::ptrdiff_t {
  filter_cart,           ///< [m]
  filter_theta,          ///< [rad] from upright
  filter_cart_velocity,  ///< [m/s]
  filter_pendulum_rate,  ///< [rad/s]
  filter_motor,          ///< [V] after a motor lag; without one it stays zero
  filter_cart_force,     ///< [N] on the cart, beyond the model
  filter_angle_zero,     ///< [rad] reading of the sensor at upright, beyond the model
  filter_states
};

/// x(k + 1) = a x(k) + late u(k - d) + early u(k - d - 1) + constant with the voltages u after the static
/// actuator chain; x += gain (y - shown) with true positions y; V += rejecting_v_per_n force.
struct KalmanStep {
  /// Limit of the linear range about upright: sin(1.2) is four fifths of 1.2.
  static constexpr double linear_within_rad = 1.2;
  using Column = std::array<double, filter_states>;

  std::array<Column, filter_states> a{};  ///< by column
  Column late{}, early{}, constant{};
  std::array<Column, 2> gain{};                     ///< of cart [m] and pendulum [rad]
  std::size_t input_periods = 0;                    ///< d
  std::array<double, 2> scale{1.0, 1.0}, offset{};  ///< the sensors show scale position + offset
  double rejecting_v_per_n = 0.0;                   ///< of a force that is to be cancelled entirely
  double share = 1.0;                               ///< of the estimated force
  double known_force_n = 0.0;                       ///< constant force of the plant file
  double dead_zone_v = 0.0;
  double rounding_voltage_v = 1.0;  ///< RMS of the feedback due to rounding

  /// `State` is indexed by FilterState.
  template <class S, class State>
  void propagate(State& state, const S& late_v, const S& early_v) const {
    State next = state;
    for (std::ptrdiff_t i = 0; i < filter_states; ++i) {
      const auto row = static_cast<std::size_t>(i);
      S sum = S(a[0][row]) * state[0];
      for (std::ptrdiff_t j = 1; j < filter_states; ++j)
        if (const double entry = a[static_cast<std::size_t>(j)][row]; entry != 0.0)
          sum = sum + S(entry) * state[j];
      next[i] = sum + S(late[row]) * late_v + S(early[row]) * early_v + S(constant[row]);
    }
    state = next;
  }

  /// `cart_off_m`, `angle_off_rad`: true positions as measured minus those of the state.
  template <class S, class State>
  void correct(State& state, const S& cart_off_m, const S& angle_off_rad) const {
    for (std::ptrdiff_t i = 0; i < filter_states; ++i) {
      const auto row = static_cast<std::size_t>(i);
      state[i] = state[i] + (S(gain[0][row]) * cart_off_m + S(gain[1][row]) * angle_off_rad);
    }
  }

  /// The position of a coordinate (0: cart, 1: pendulum) of which the sensor shows this.
  template <class S>
  S position_of(std::size_t coordinate, const S& shown) const {
    return (shown - S(offset[coordinate])) / S(scale[coordinate]);
  }

  /// The voltage that cancels `force_n`, given as estimated times share, and the known force.
  template <class S>
  S rejecting_v(const S& force_n) const {
    return S(rejecting_v_per_n) * (force_n + S(share * known_force_n));
  }

  /// The command that yields `wanted_v` after the dead zone.
  template <class S>
  S command_v(const S& wanted_v) const {
    if (!(dead_zone_v > 0.0)) return wanted_v;
    const S part = wanted_v / S(rounding_voltage_v), one(1.0), minus_one(-1.0);
    const S side = select(part < minus_one, minus_one, select(part > one, one, part));
    return wanted_v + S(dead_zone_v) * side;
  }
};

}  // namespace upright
