// sign_check: low pulses that tell whether signs and directions agree.
#pragma once

#include <algorithm>
#include <vector>

#include "experiment/piece.hpp"

namespace upright::pieces {

class SignCheck final : public PieceOf<SignCheck> {
 public:
  static constexpr const char* kind = "sign_check";

  void keys(PieceKeys& keys) override {
    keys.largest_voltage("largest_v", largest_v_, 4.0);
    keys.number("patience_s", patience_s_, any_duration, 60.0);
  }

  const char* request() const override { return "let the pendulum hang still, the cart near the middle"; }

  /// From low to the largest voltage; a largest one below the first step is the only one.
  std::vector<Stretch> stretches(const ScriptContext&) const override {
    constexpr double step_v = 0.5, pulse_s = 0.12;
    std::vector<Stretch> list;
    for (double v = std::min(2.0 * step_v, largest_v_);; v = std::min(v + step_v, largest_v_)) {
      for (const double direction : {1.0, -1.0}) list.push_back({0.0, direction * v, pulse_s});
      if (v >= largest_v_) return list;
    }
  }
  bool is_driven() const noexcept override { return false; }
  Opening opening() const noexcept override { return Opening::waiting; }
  double patience_s() const noexcept override { return patience_s_; }
  StretchStatus status(const Excitation& at) noexcept override {
    constexpr double after_pulse_s = 1.2, felt_m = 0.005;
    farthest_m_ = std::max(farthest_m_, at.moved_m);
    const bool done = at.acted_s >= at.stretch.duration_s + after_pulse_s;
    if (done && farthest_m_ > felt_m) ++pulses_felt_;
    if (at.moved_m > at.context.travel_m) return StretchStatus::lost;
    return done ? StretchStatus::done : StretchStatus::goes_on;
  }
  double voltage_v(const Excitation& at) noexcept override {
    return at.acted_s < at.stretch.duration_s ? at.stretch.voltage_v : 0.0;
  }
  /// Two pulses in a row that moved the cart are enough.
  bool has_enough(std::size_t done) noexcept override {
    farthest_m_ = 0.0;
    return pulses_felt_ >= 2 && done % 2 == 0;
  }

 private:
  double largest_v_ = 0.0, patience_s_ = 0.0;
  // While it runs:
  double farthest_m_ = 0.0;  ///< of this pulse, from where it began
  int pulses_felt_ = 0;
};

}  // namespace upright::pieces
