// constant_voltage: from one side of the track to the other, in both directions.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/number_text.hpp"
#include "experiment/piece.hpp"
#include "upright/model/elementary.hpp"

namespace upright::pieces {

class ConstantVoltage final : public PieceOf<ConstantVoltage> {
 public:
  static constexpr const char* kind = "constant_voltage";

  void keys(PieceKeys& keys) override {
    keys.voltages("voltages_v", voltages_v_);
    keys.integer("repeats", repeats_, 1, 100, 1);
  }
  bool may_fit() const override { return true; }
  PieceTime time() const override {
    constexpr double stretch_s = 1.0;  // of one voltage in one direction
    return {stretch_s * (2.0 * repeats_ * static_cast<double>(voltages_v_.size())), "voltages_v"};
  }

  /// It must reach its speed on the travel.
  std::optional<Refusal> unreachable(const ScriptContext& context) const override {
    const ServoModel& m = context.servo;
    const double room_m = 2.0 * context.travel_m;
    for (const double v : voltages_v_) {
      if (m.force_per_volt_n * v <= 1.05 * m.sliding_n)
        return Refusal{
            "voltages_v", "would not keep the cart moving at " + brief_text(v) + " V",
            "raise the voltage above " + brief_text(1.05 * m.sliding_n / m.force_per_volt_n) + " V"};
      const double needed_m = length_for_m(v, context);
      if (needed_m <= room_m) continue;
      double fits = v;
      while (fits > 0.05 && length_for_m(fits, context) > room_m) fits *= 0.98;
      return Refusal{"voltages_v",
                     "needs " + brief_text(needed_m) + " m to reach its speed at " + brief_text(v) +
                         " V and to stop, but has " + brief_text(room_m) + " m",
                     "lower the voltage to " + brief_text(fits) + " V, or raise travel_m to " +
                         brief_text(0.5 * needed_m)};
    }
    return std::nullopt;
  }

  std::vector<Stretch> stretches(const ScriptContext& context) const override {
    constexpr double longest_s = 10.0;  // the travel ends it before
    std::vector<Stretch> list;
    for (int i = 0; i < repeats_; ++i)
      for (const double v : voltages_v_)
        for (const double side : {1.0, -1.0}) list.push_back({-side * context.side_m(), side * v, longest_s});
    return list;
  }
  /// A kick first, where the voltage would not break the cart away.
  double voltage_v(const Excitation& at) noexcept override {
    constexpr double kick_s = 0.1;
    const double v = at.stretch.voltage_v;
    if (at.acted_s >= kick_s) return v;
    const double breakaway_v = at.context.servo.breakaway_n / at.context.servo.force_per_volt_n;
    return (v < 0.0 ? -1.0 : 1.0) * std::max(std::abs(v), 1.2 * breakaway_v);
  }

 private:
  /// To come within 5 percent of its speed, to keep it long enough to be worth measuring, and to stop.
  static double length_for_m(double voltage_v, const ScriptContext& context) {
    constexpr double steady_s = 0.15, start_and_end_m = 0.03;
    const ServoModel& m = context.servo;
    const double tau = m.mass_kg / std::max(m.damping_n_per_mps, 1e-6);
    ControlState now;
    now.cart_velocity_mps =
        std::max(0.0, (m.force_per_volt_n * voltage_v - m.sliding_n) / m.damping_n_per_mps);
    return now.cart_velocity_mps * (3.0 * tau - tau * (1.0 - elementary::exp(-3.0)) + steady_s) +
           stop_position_m(context, now) + start_and_end_m;
  }

  std::vector<double> voltages_v_;
  int repeats_ = 1;
};

}  // namespace upright::pieces
