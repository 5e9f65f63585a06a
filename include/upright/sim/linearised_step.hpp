// A step of the motion with derivatives at the price of one evaluation with dual numbers: those of the motion
// linearised in the middle of the step, whose values are known.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

#include "upright/model/dynamics.hpp"
#include "upright/model/elementary.hpp"

namespace upright {

/// The values of a state, without their derivatives.
template <class S>
PlantState<double> plain_state(const PlantState<S>& s) {
  return {value_of(s.cart_m),  value_of(s.theta_rad), value_of(s.cart_mps),   value_of(s.theta_radps),
          value_of(s.motor_v), value_of(s.bristle_m), value_of(s.attached_m), value_of(s.attached_mps)};
}

/// A voltage that is held for a time.
template <class S>
struct HeldVoltage {
  S duration_s{};          ///< how long [s]
  double voltage_v = 0.0;  ///< after the input delay [V]
};

/// The motor's voltage over a step, with the derivatives at this length.
template <class S>
struct StepVoltage {
  S mean_v{};      ///< gives the same impulse [V]
  S end_v{};       ///< at the end of the step [V]
  S moment_vs2{};  ///< first moment about the end of the step, beyond that of the mean [V s^2]
};

/// Of a motor that lags behind a held drive with this time constant, over a step of length h.
template <class S>
StepVoltage<S> lagged_voltage(const S& motor_v, const S& drive_v, const S& time_constant_s, const S& h) {
  const double length_s = value_of(h);
  const S gap_v = motor_v - drive_v, lags = S(length_s) / time_constant_s;
  const S mean = (S(1.0) - elementary::exp(S(-lags))) / lags;
  const S moment = (S(1.0) - mean) / lags - S(0.5) * mean;
  return {drive_v + gap_v * mean, drive_v + gap_v * elementary::exp(S(-h / time_constant_s)),
          S(length_s * length_s) * gap_v * moment};
}

/// For dual numbers S. The dynamics must outlive it.
template <class S>
class LinearisedStep {
 public:
  /// `plain`: the same dynamics without derivatives. `cart_moves`, `pivot_moves`: the cart and the pendulum
  /// are there, and neither locked nor held by dry friction.
  LinearisedStep(const Dynamics<S>& dynamics, const Dynamics<double>& plain, const Contacts& contacts,
                 bool cart_moves, bool pivot_moves)
      : dynamics_(dynamics),
        plain_(plain),
        contacts_(contacts),
        cart_moves_(cart_moves),
        pivot_moves_(pivot_moves) {}

  /// Moves a state over a step of length h to the values of `end`, and its derivatives by
  /// x(h) = x + (h + h^2 A / 2 + h^3 A^2 / 6) (A x + b). A varying voltage counts with its mean and its first
  /// moment. `seeded`: the derivatives at the beginning are the identity (EventEngine::seed).
  void take(const PlantState<double>& end, const S& h, const StepVoltage<S>& voltage, bool seeded,
            PlantState<S>& state) const {
    // The Jacobian is evaluated at the middle, the derivatives are those at the beginning.
    const PlantState<double> middle = moved_halfway(end, state);
    const PlantState<S> rate = dynamics_.derivative(state, voltage.mean_v, contacts_);
    const PlantState<double> plain_rate = plain_state(rate);
    const double cart_moves = cart_moves_ ? 1.0 : 0.0;
    const double pivot_moves = pivot_moves_ ? 1.0 : 0.0;
    // Coordinates that started to move since the seeding have no derivatives.
    const bool all_seeded =
        seeded && state.cart_mps.v[2] == cart_moves && state.theta_radps.v[3] == pivot_moves;
    const Slopes slopes =
        all_seeded ? seeded_slopes(rate) : slopes_at(middle, plain_rate, value_of(voltage.mean_v));
    // Derivatives of the solution: rate is A x + b, `second` A (A x + b), `third` A A (A x + b).
    const auto bend = [](const std::array<double, 4>& slope, const auto& x, const auto& theta, const auto& v,
                         const auto& omega) {
      return std::decay_t<decltype(v)>(slope[0] * x + slope[1] * theta + slope[2] * v + slope[3] * omega);
    };
    const Slope second_v =
        bend(slopes.cart_mps2, rate.cart_m.v, rate.theta_rad.v, rate.cart_mps.v, rate.theta_radps.v);
    const Slope second_omega =
        bend(slopes.theta_radps2, rate.cart_m.v, rate.theta_rad.v, rate.cart_mps.v, rate.theta_radps.v);
    const Slope second_x = cart_moves * rate.cart_mps.v, second_theta = pivot_moves * rate.theta_radps.v;
    const Slope third_v = bend(slopes.cart_mps2, second_x, second_theta, second_v, second_omega);
    const Slope third_omega = bend(slopes.theta_radps2, second_x, second_theta, second_v, second_omega);
    const double length = h.a, half_square = 0.5 * length * length, cube = half_square * length / 3.0;
    const auto bent = [&](const std::array<double, 4>& slope) {
      return bend(slope, plain_rate.cart_m, plain_rate.theta_rad, plain_rate.cart_mps,
                  plain_rate.theta_radps);
    };
    // The step length may have derivatives too.
    PlantState<double> late = plain_rate;
    Slope moved_x{}, moved_theta{};
    if (const double rise_v = value_of(voltage.end_v - voltage.mean_v); rise_v != 0.0) {
      late = plain_.derivative(middle, value_of(voltage.end_v), contacts_);
      moved_x = (late.cart_mps - plain_rate.cart_mps) / rise_v * voltage.moment_vs2.v;
      moved_theta = (late.theta_radps - plain_rate.theta_radps) / rise_v * voltage.moment_vs2.v;
    }
    const double v_rate = late.cart_mps + 0.5 * length * bent(slopes.cart_mps2);
    const double omega_rate = late.theta_radps + 0.5 * length * bent(slopes.theta_radps2);
    const auto set = [&](S& number, double value, const Slope& first, const Slope& second, const auto& third,
                         double rate_at_end) {
      number.a = value;
      number.v += length * first + half_square * second + cube * third + rate_at_end * h.v;
    };
    set(state.cart_m, end.cart_m, rate.cart_m.v, second_x, cart_moves * second_v, cart_moves * end.cart_mps);
    set(state.theta_rad, end.theta_rad, rate.theta_rad.v, second_theta, pivot_moves * second_omega,
        pivot_moves * end.theta_radps);
    set(state.cart_mps, end.cart_mps, rate.cart_mps.v, second_v, third_v, v_rate);
    set(state.theta_radps, end.theta_radps, rate.theta_radps.v, second_omega, third_omega, omega_rate);
    state.cart_m.v += moved_x;
    state.theta_rad.v += moved_theta;
    state.cart_mps.v += slopes.cart_mps2[2] * moved_x + slopes.cart_mps2[3] * moved_theta;
    state.theta_radps.v += slopes.theta_radps2[2] * moved_x + slopes.theta_radps2[3] * moved_theta;
    state.motor_v = voltage.end_v;
  }

 private:
  using Slope = decltype(S::v);

  /// Moves the values of the coordinates halfway to `end`. Returns them.
  static PlantState<double> moved_halfway(const PlantState<double>& end, PlantState<S>& state) {
    PlantState<double> middle;
    const auto halfway = [&](double PlantState<double>::*of, S& number) {
      number.a = middle.*of = 0.5 * (number.a + end.*of);
    };
    halfway(&PlantState<double>::cart_m, state.cart_m);
    halfway(&PlantState<double>::theta_rad, state.theta_rad);
    halfway(&PlantState<double>::cart_mps, state.cart_mps);
    halfway(&PlantState<double>::theta_radps, state.theta_radps);
    return middle;
  }

  /// Jacobian of the accelerations: columns cart_m, theta_rad, cart_mps, theta_radps.
  struct Slopes {
    std::array<double, 4> cart_mps2{}, theta_radps2{};
  };
  /// The Jacobian from the derivatives of `rate`, for a state with the identity as derivatives.
  static Slopes seeded_slopes(const PlantState<S>& rate) {
    Slopes slopes;
    for (int i = 0; i < 4; ++i) {
      slopes.cart_mps2[static_cast<std::size_t>(i)] = rate.cart_mps.v[i];
      slopes.theta_radps2[static_cast<std::size_t>(i)] = rate.theta_radps.v[i];
    }
    return slopes;
  }
  Slopes slopes_at(const PlantState<double>& middle, const PlantState<double>& rate, double motor_v) const {
    constexpr double aside = 1e-6;
    Slopes slopes;
    const auto set = [&](std::size_t column, double PlantState<double>::*of) {
      PlantState<double> moved_aside = middle;
      moved_aside.*of += aside;
      const PlantState<double> other = plain_.derivative(moved_aside, motor_v, contacts_);
      slopes.cart_mps2[column] = (other.cart_mps - rate.cart_mps) / aside;
      slopes.theta_radps2[column] = (other.theta_radps - rate.theta_radps) / aside;
    };
    set(0, &PlantState<double>::cart_m);
    set(2, &PlantState<double>::cart_mps);
    if (!dynamics_.has_pendulum()) return slopes;
    set(1, &PlantState<double>::theta_rad);
    set(3, &PlantState<double>::theta_radps);
    return slopes;
  }

  const Dynamics<S>& dynamics_;
  const Dynamics<double>& plain_;
  Contacts contacts_;
  bool cart_moves_, pivot_moves_;
};

}  // namespace upright
