// coast: a push, then zero volts, in both directions.
#pragma once

#include <cmath>
#include <vector>

#include "experiment/piece.hpp"

namespace upright::pieces {

class Coast final : public PieceOf<Coast> {
 public:
  static constexpr const char* kind = "coast";

  void keys(PieceKeys& keys) override {
    keys.voltages("voltages_v", voltages_v_);
    keys.number("push_s", push_s_, Range{0.0, 10.0, true}, required);
    keys.integer("repeats", repeats_, 1, 100, 1);
  }
  bool may_fit() const override { return true; }
  PieceTime time() const override {
    return {push_s_ * (2.0 * repeats_ * static_cast<double>(voltages_v_.size())), "voltages_v"};
  }

  std::vector<Stretch> stretches(const ScriptContext& context) const override {
    std::vector<Stretch> list;
    for (int i = 0; i < repeats_; ++i)
      for (const double v : voltages_v_)
        for (const double side : {1.0, -1.0})
          list.push_back({-0.7 * side * context.side_m(), side * v, push_s_});
    return list;
  }
  /// Zero volts as soon as the coasting cart would just stay within its travel.
  StretchStatus status(const Excitation& at) noexcept override {
    constexpr double longest_coast_s = 2.0, shortest_s = 0.1;
    const ServoModel& m = at.context.servo;
    const double v = at.now.cart_velocity_mps;
    const double coast_m = m.damping_n_per_mps > 0.0 ? v * m.mass_kg / m.damping_n_per_mps : 0.0;
    pushed_ = pushed_ || at.acted_s >= at.stretch.duration_s ||
              std::abs(at.now.cart_m + coast_m) > at.context.travel_m;
    const bool done = at.acted_s >= at.stretch.duration_s + longest_coast_s ||
                      (pushed_ && at.acted_s > shortest_s && std::abs(v) < standing_mps);
    return done ? StretchStatus::done : StretchStatus::goes_on;
  }
  double voltage_v(const Excitation& at) noexcept override { return pushed_ ? 0.0 : at.stretch.voltage_v; }
  bool has_enough(std::size_t) noexcept override {
    pushed_ = false;
    return false;
  }

 private:
  std::vector<double> voltages_v_;
  double push_s_ = 0.0;
  int repeats_ = 1;
  bool pushed_ = false;  ///< while it runs: the push of this stretch is over
};

}  // namespace upright::pieces
