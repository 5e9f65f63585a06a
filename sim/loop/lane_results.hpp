// Results of parallel runs so far, by lane.
#pragma once

#include <bit>
#include <cmath>
#include <span>

#include "lane_model.hpp"
#include "loop_run.hpp"

namespace upright {

class LaneResults {
 public:
  explicit LaneResults(const LoopSetup& setup)
      : fell_above_rad_(setup.fell_above_rad), window_begin_s_(setup.window_begin_s()) {}

  /// Begins a run in this lane.
  void begin(std::size_t lane) {
    alive_ |= 1u << lane;
    fall_time_s_[lane] = std::numeric_limits<double>::quiet_NaN();
    for (Lanes* zero : {&previous_theta_, &previous_s_, &cart_max_, &squares_v2_, &periods_})
      put(*zero, lane, 0.0);
    for (Lanes* low : {&theta_low_, &cart_low_}) put(*low, lane, infinite);
    for (Lanes* high : {&theta_high_, &cart_high_}) put(*high, lane, -infinite);
  }

  /// Records the motion of these lanes, each at its time, and the voltage before it. Fallen lanes are reset
  /// to rest upright.
  template <class Mask>
  void take(const Mask& lanes, const Lanes& time_s, PlantState<Lanes>& state, const Lanes& voltage_v) {
    const LaneMask fallen = lanes & !(absolute(state.theta_rad) < Lanes(fell_above_rad_));
    if (any(fallen)) drop_fallen(fallen.bits(), time_s, state);
    previous_theta_ = select(lanes, state.theta_rad, previous_theta_);
    previous_s_ = select(lanes, time_s, previous_s_);
    cart_max_ = select(lanes, larger(cart_max_, absolute(state.cart_m)), cart_max_);
    const LaneMask late = lanes & (time_s >= Lanes(window_begin_s_));
    if (!any(late)) return;
    theta_low_ = select(late, smaller(theta_low_, state.theta_rad), theta_low_);
    theta_high_ = select(late, larger(theta_high_, state.theta_rad), theta_high_);
    cart_low_ = select(late, smaller(cart_low_, state.cart_m), cart_low_);
    cart_high_ = select(late, larger(cart_high_, state.cart_m), cart_high_);
    squares_v2_ = select(late, squares_v2_ + voltage_v * voltage_v, squares_v2_);
    periods_ = select(late, periods_ + Lanes(1.0), periods_);
  }

  /// Bit i: the run of lane i has not fallen.
  std::uint32_t alive() const { return alive_; }

  /// Of the run in this lane, which ends in `state` unless it has fallen. The lane has none then.
  LoopResult finish(std::size_t i, const PlantState<Lanes>& state) {
    alive_ &= ~(1u << i);
    LoopResult result;
    result.fall_time_s = fall_time_s_[i];
    if (result.fell()) {
      result.theta_amplitude_rad = fell_above_rad_;
      result.cart_amplitude_m = fallen_cart_m_[i];
      result.end = fallen_[i];
      return result;
    }
    const auto value = [i](const Lanes& lanes) { return lanes.values()[i]; };
    result.theta_amplitude_rad = 0.5 * value(theta_high_ - theta_low_);
    result.cart_amplitude_m = 0.5 * value(cart_high_ - cart_low_);
    result.voltage_rms_v = std::sqrt(value(squares_v2_) / value(periods_));
    result.end = {value(state.cart_m),      value(state.theta_rad), value(state.cart_mps),
                  value(state.theta_radps), value(state.motor_v),   value(state.bristle_m)};
    return result;
  }

 private:
  void drop_fallen(std::uint32_t fallen, const Lanes& time_s, PlantState<Lanes>& state) {
    auto x = state.cart_m.values(), th = state.theta_rad.values(), v = state.cart_mps.values(),
         w = state.theta_radps.values(), z = state.bristle_m.values();
    const auto before = previous_theta_.values(), cart_max = cart_max_.values(), now_s = time_s.values(),
               previous_s = previous_s_.values();
    for (; fallen != 0; fallen &= fallen - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(fallen));
      if ((alive_ >> i & 1u) != 0) {
        alive_ &= ~(1u << i);
        const double rise = std::abs(th[i]) - std::abs(before[i]);
        const double part = rise > 0.0 ? (fell_above_rad_ - std::abs(before[i])) / rise : 1.0;
        fall_time_s_[i] = previous_s[i] + std::clamp(part, 0.0, 1.0) * (now_s[i] - previous_s[i]);
        fallen_cart_m_[i] = std::max(cart_max[i], std::abs(x[i]));
        fallen_[i] = {x[i], th[i], v[i], w[i], 0.0, z[i]};
      }
      x[i] = th[i] = v[i] = w[i] = z[i] = 0.0;
    }
    state.cart_m = Lanes::load(x.data());
    state.theta_rad = Lanes::load(th.data());
    state.cart_mps = Lanes::load(v.data());
    state.theta_radps = Lanes::load(w.data());
    state.bristle_m = Lanes::load(z.data());
  }

  static constexpr double infinite = std::numeric_limits<double>::infinity();
  double fell_above_rad_, window_begin_s_;
  std::uint32_t alive_ = 0;
  std::array<double, lane_count> fall_time_s_{}, fallen_cart_m_{};
  std::array<PlantState<double>, lane_count> fallen_{};
  Lanes previous_theta_, previous_s_, cart_max_;
  Lanes squares_v2_, periods_;  ///< of the last third
  Lanes theta_low_{infinite}, theta_high_{-infinite}, cart_low_{infinite}, cart_high_{-infinite};
};

}  // namespace upright
