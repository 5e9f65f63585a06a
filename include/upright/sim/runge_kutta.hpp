// The classical Runge-Kutta method of order 4 on a plant's state, for any scalar: double, dual numbers,
// lanes. Bristles with fast relaxation are integrated by its exponential form.
#pragma once

#include <array>
#include <cmath>
#include <type_traits>

#include "upright/model/dynamics.hpp"
#include "upright/model/elementary.hpp"

namespace upright {

/// Whether the voltage at the motor is a state variable, or constant over the step.
enum class MotorVoltage : std::uint8_t { held, moves };

/// Whether the states of an attached mass may be part of the state. Without one, lanes carry less.
enum class AttachedStates : std::uint8_t { absent, possible };

/// The state after `h` at this rate [s].
template <MotorVoltage motor = MotorVoltage::held, AttachedStates attached = AttachedStates::absent, class S>
PlantState<S> moved(const PlantState<S>& s, const PlantState<S>& rate, const S& h) {
  PlantState<S> to{s.cart_m + h * rate.cart_m,
                   s.theta_rad + h * rate.theta_rad,
                   s.cart_mps + h * rate.cart_mps,
                   s.theta_radps + h * rate.theta_radps,
                   s.motor_v,
                   s.bristle_m + h * rate.bristle_m};
  if constexpr (motor == MotorVoltage::moves) to.motor_v = s.motor_v + h * rate.motor_v;
  if constexpr (attached == AttachedStates::possible) {
    to.attached_m = s.attached_m + h * rate.attached_m;
    to.attached_mps = s.attached_mps + h * rate.attached_mps;
  }
  return to;
}

/// Coefficients of the bristles at the beginning of a step, for the exponential method below. The method
/// has order 4 for any coefficients; accurate ones reduce the error of long steps.
struct Bristles {
  double relaxation_radps = 0.0;   ///< R, including the velocity that their damping gives the cart
  double drift_mps2 = 0.0;         ///< rate of change of the remaining part of their rate
  double cart_mps_per_m = 0.0;     ///< velocity that their damping takes from the cart per deflection
  double theta_radps_per_m = 0.0;  ///< rate that their damping takes from the pendulum per deflection
};

/// Bristles within a step of length h for any relaxation rate: dz/dt = -R z + drift t + smooth part, by
/// ETDRK4, equations (26)-(29) of Cox and Matthews, "Exponential time differencing for stiff systems", J.
/// Comput. Phys. 176 (2002). With all of `Bristles` zero it is the classical method. The impulse of their
/// damping on the cart follows from their displacement, not from their rate at the nodes.
template <class S>
struct Relaxation {
  Bristles bristles;               ///< coefficients at the begin of the step
  S half_decay;                    ///< exp(-R h / 2)
  S decay;                         ///< exp(-R h)
  S half_weight;                   ///< weight of the smooth part over half the step
  std::array<S, 3> whole_weights;  ///< of the smooth part at the beginning, in the middle and at the end
  S first_half_m;                  ///< contribution of the drift over the first half
  S second_half_m;                 ///< contribution of the drift over the second half
  S whole_m;                       ///< contribution of the drift over the whole step
  S half_drift_mps;                ///< drift in the middle
  S drift_mps;                     ///< drift at the end

  /// The smooth part of their rate at a drift of `drift`.
  S smooth(const PlantState<S>& at, const PlantState<S>& rate, const S& drift) const {
    return rate.bristle_m + S(bristles.relaxation_radps) * at.bristle_m - drift;
  }
  /// Replaces the deflection that the classical method gives, and the cart's velocity accordingly.
  void put(PlantState<S>& at, const S& bristle_m) const {
    const S aside = bristle_m - at.bristle_m;
    at.bristle_m = bristle_m;
    at.cart_mps = at.cart_mps - S(bristles.cart_mps_per_m) * aside;
    at.theta_radps = at.theta_radps - S(bristles.theta_radps_per_m) * aside;
  }

  /// Over a step of `h` [s].
  Relaxation(const Bristles& those, const S& h) : bristles(those) {
    const double rate = bristles.relaxation_radps;
    const Phi half(-0.5 * rate * value_of(h)), whole(-rate * value_of(h));
    const double length = value_of(h);
    half_decay = along(h, half.zero, -0.5 * rate * half.zero);
    decay = along(h, whole.zero, -rate * whole.zero);
    half_weight = along(h, 0.5 * length * half.one, 0.5 * half.zero);
    constexpr double of_phi[3][3] = {{1.0, -3.0, 4.0}, {0.0, 2.0, -4.0}, {0.0, -1.0, 4.0}};
    for (std::size_t i = 0; i < 3; ++i) {
      double weight = 0.0, slope = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        weight += of_phi[i][k] * length * whole.values()[k];
        slope += of_phi[i][k] * whole.slope_of_length(k);
      }
      whole_weights[i] = along(h, weight, slope);
    }
    const double drift = bristles.drift_mps2, q = 0.5 * length;
    const double to_middle = q * q * half.two, slope_to_middle = q + half.c * q * half.two;
    first_half_m = along(h, drift * to_middle, 0.5 * drift * slope_to_middle);
    second_half_m = along(h, drift * (q * q * half.one + to_middle),
                          0.5 * drift * (q * half.one + q * half.zero + slope_to_middle));
    whole_m = along(h, drift * length * length * whole.two, drift * length * (1.0 + whole.c * whole.two));
    half_drift_mps = along(h, drift * q, 0.5 * drift);
    drift_mps = along(h, drift * length, drift);
  }

 private:
  /// phi_0(c) = exp(c), phi_k(c) = (phi_{k-1}(c) - 1 / (k-1)!) / c.
  struct Phi {
    double c, zero, one, two, three;

    explicit Phi(double at) : c(at) {
      constexpr double series_within = 1.0;
      if (std::abs(c) > series_within) {
        zero = elementary::exp(c);
        one = (zero - 1.0) / c;
        two = (one - 1.0) / c;
        three = (two - 0.5) / c;
        return;
      }
      constexpr int last = 18;  // number of terms: the remainder is below the rounding error
      double term = 1.0;
      for (int k = last; k > 3; --k) term = 1.0 + term * c / k;
      three = term / 6.0;
      two = 0.5 + c * three;
      one = 1.0 + c * two;
      zero = 1.0 + c * one;
    }
    std::array<double, 3> values() const { return {one, two, three}; }
    /// d (h phi_{k+1}(-R h)) / dh.
    double slope_of_length(std::size_t k) const {
      constexpr std::array<double, 3> inverse_factorial = {1.0, 1.0, 0.5};
      const double order = static_cast<double>(k) + 1.0;
      return (1.0 - order + c) * values()[k] + inverse_factorial[k];
    }
  };

  /// A function of the step length from its value and its derivative.
  static S along([[maybe_unused]] const S& h, double value, [[maybe_unused]] double slope) {
    if constexpr (std::is_same_v<S, double>)
      return value;
    else
      return S(value) + S(slope) * (h - S(value_of(h)));
  }
};

/// The node of a step at which a rate is evaluated. The caller evaluates that of the beginning.
enum class Stage : std::uint8_t { middle, end };

/// One step of length h from `s`. `first`: the rate at its beginning; `rate(state, Stage)`: at the other
/// nodes. `bristles`: their motion, as `Relaxation` says it, null where no relaxation is fast.
template <MotorVoltage motor = MotorVoltage::held, AttachedStates attached = AttachedStates::absent, class S,
          class Rate, class Motion = Relaxation<S>>
PlantState<S> runge_kutta_4(const Rate& rate, const PlantState<S>& s, const PlantState<S>& first, const S& h,
                            const Motion* bristles = nullptr) {
  const S half = S(0.5) * h;
  S begin_smooth{}, middle_smooth{}, again_smooth{}, middle_m{};
  PlantState<S> at = moved<motor, attached>(s, first, half);
  if (bristles != nullptr) {
    begin_smooth = bristles->smooth(s, first, S(0.0));
    middle_m =
        bristles->half_decay * s.bristle_m + bristles->half_weight * begin_smooth + bristles->first_half_m;
    bristles->put(at, middle_m);
  }
  const PlantState<S> second = rate(at, Stage::middle);
  if (bristles != nullptr) middle_smooth = bristles->smooth(at, second, bristles->half_drift_mps);
  at = moved<motor, attached>(s, second, half);
  if (bristles != nullptr)
    bristles->put(at, bristles->half_decay * s.bristle_m + bristles->half_weight * middle_smooth +
                          bristles->first_half_m);
  const PlantState<S> third = rate(at, Stage::middle);
  if (bristles != nullptr) again_smooth = bristles->smooth(at, third, bristles->half_drift_mps);
  at = moved<motor, attached>(s, third, h);
  if (bristles != nullptr)
    bristles->put(at, bristles->half_decay * middle_m +
                          bristles->half_weight * (S(2.0) * again_smooth - begin_smooth) +
                          bristles->second_half_m);
  const PlantState<S> fourth = rate(at, Stage::end);
  const S sixth = h / S(6.0);
  const auto along = [&](S PlantState<S>::*of) {
    return s.*of + sixth * (first.*of + S(2.0) * (second.*of + third.*of) + fourth.*of);
  };
  PlantState<S> end;
  end.cart_m = along(&PlantState<S>::cart_m);
  end.theta_rad = along(&PlantState<S>::theta_rad);
  end.cart_mps = along(&PlantState<S>::cart_mps);
  end.theta_radps = along(&PlantState<S>::theta_radps);
  end.motor_v = s.motor_v;
  if constexpr (motor == MotorVoltage::moves) end.motor_v = along(&PlantState<S>::motor_v);
  end.bristle_m = along(&PlantState<S>::bristle_m);
  if constexpr (attached == AttachedStates::possible) {
    end.attached_m = along(&PlantState<S>::attached_m);
    end.attached_mps = along(&PlantState<S>::attached_mps);
  }
  if (bristles != nullptr) {
    const auto& [begin, middle, last] = bristles->whole_weights;
    bristles->put(end, bristles->decay * s.bristle_m + begin * begin_smooth +
                           middle * (middle_smooth + again_smooth) +
                           last * bristles->smooth(at, fourth, bristles->drift_mps) + bristles->whole_m);
  }
  return end;
}

/// The length of the first of the fewest equal steps over this time that are no longer than `limit_s`.
template <class S>
S even_step(const S& remaining_s, double limit_s) {
  constexpr double slack = 1e-9;  // sums of times are rounded
  const double pieces = std::ceil(value_of(remaining_s) / limit_s - slack);
  return pieces <= 1.0 ? remaining_s : S(remaining_s / S(pieces));
}

}  // namespace upright
