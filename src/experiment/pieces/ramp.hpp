// ramp: from the middle, slowly up to breakaway, in both directions.
#pragma once

#include <cmath>
#include <vector>

#include "experiment/piece.hpp"

namespace upright::pieces {

class Ramp final : public PieceOf<Ramp> {
 public:
  static constexpr const char* kind = "ramp";

  void keys(PieceKeys& keys) override {
    keys.number("rate_v_per_s", rate_v_per_s_, Range{0.0, 10.0, true}, required);
    keys.largest_voltage("largest_v", largest_v_, 4.0);
    keys.integer("repeats", repeats_, 1, 100, 1);
  }
  PieceTime time() const override { return {2.0 * repeats_ * largest_v_ / rate_v_per_s_, "rate_v_per_s"}; }

  std::vector<Stretch> stretches(const ScriptContext&) const override {
    std::vector<Stretch> list;
    for (int i = 0; i < repeats_; ++i)
      for (const double direction : {1.0, -1.0}) list.push_back({0.0, direction, 0.0});
    return list;
  }
  StretchStatus status(const Excitation& at) noexcept override {
    constexpr double breakaway_mps = 0.03, breakaway_m = 0.03;  // the cart has clearly moved
    const bool done = std::abs(at.now.cart_velocity_mps) > breakaway_mps || at.moved_m > breakaway_m ||
                      rate_v_per_s_ * at.acted_s > largest_v_;
    return done ? StretchStatus::done : StretchStatus::goes_on;
  }
  double voltage_v(const Excitation& at) noexcept override {
    return at.stretch.voltage_v * rate_v_per_s_ * at.acted_s;
  }

 private:
  double rate_v_per_s_ = 0.0, largest_v_ = 0.0;
  int repeats_ = 1;
};

}  // namespace upright::pieces
