// slow_sine: the cart follows a slow sine under a velocity servo (the paper's Figure 5).
#pragma once

#include <numbers>
#include <vector>

#include "experiment/piece.hpp"
#include "upright/model/elementary.hpp"

namespace upright::pieces {

class SlowSine final : public PieceOf<SlowSine> {
 public:
  static constexpr const char* kind = "slow_sine";

  void keys(PieceKeys& keys) override {
    keys.number("amplitude_m", amplitude_m_, Range{0.0, longest_travel_m, true}, required);
    keys.number("period_s", period_s_, any_period, required);
    keys.number("duration_s", duration_s_, any_duration, required);
  }
  void refuse_beyond(double travel_m, const YamlMap& map) const override {
    if (amplitude_m_ >= travel_m)
      map.fail("amplitude_m", "is not below travel_m", "lower it, or raise travel_m");
  }
  PieceTime time() const override { return {duration_s_}; }

  std::vector<Stretch> stretches(const ScriptContext&) const override { return {{0.0, 0.0, duration_s_}}; }
  bool resumes() const noexcept override { return true; }
  double voltage_v(const Excitation& at) noexcept override {
    const double omega = 2.0 * std::numbers::pi / period_s_;
    const double wanted_m = amplitude_m_ * elementary::sin(omega * at.acted_s);
    const double speed_mps = amplitude_m_ * omega * elementary::cos(omega * at.acted_s) +
                             approach_per_s * (wanted_m - at.now.cart_m);
    return at.servo.voltage_v(speed_mps, at.now, at.elapsed_s);
  }

 private:
  double amplitude_m_ = 0.0, period_s_ = 0.0, duration_s_ = 0.0;
};

}  // namespace upright::pieces
