// multisine: lines of the voltage's spectrum, spaced evenly in log frequency.
#pragma once

#include <algorithm>
#include <numbers>
#include <vector>

#include "experiment/piece.hpp"
#include "upright/model/elementary.hpp"

namespace upright::pieces {

class Multisine final : public PieceOf<Multisine> {
 public:
  static constexpr const char* kind = "multisine";

  void keys(PieceKeys& keys) override {
    const Range hertz = Range::within(1e-3, 1000.0);
    keys.voltage("amplitude_v", amplitude_v_);
    keys.number("lowest_hz", lowest_hz_, hertz, required);
    keys.number("highest_hz", highest_hz_, hertz, required);
    keys.check("highest_hz", highest_hz_ > lowest_hz_, "is not above lowest_hz",
               "set it to a higher frequency");
    keys.integer("lines", lines_, 2, 64, 8);
    keys.number("duration_s", duration_s_, any_duration, required);
  }
  bool may_fit() const override { return true; }
  PieceTime time() const override { return {duration_s_}; }

  std::vector<Stretch> stretches(const ScriptContext&) const override {
    return {{0.0, amplitude_v_, duration_s_}};
  }
  bool resumes() const noexcept override { return true; }
  double voltage_v(const Excitation& at) noexcept override {
    const double ratio = elementary::power(highest_hz_ / lowest_hz_, 1.0 / (lines_ - 1));
    double frequency_hz = lowest_hz_, sum = 0.0;
    for (int i = 0; i < lines_; ++i, frequency_hz *= ratio)
      sum += elementary::sin(2.0 * std::numbers::pi * frequency_hz * at.acted_s + phase_rad(i));
    return std::clamp(2.0 * sum / lines_, -1.0, 1.0) * at.stretch.voltage_v;
  }

 private:
  /// Phases that grow with the square of the line keep the peaks apart.
  static double phase_rad(int line) { return 1.3 * static_cast<double>(line * line); }

  double amplitude_v_ = 0.0, lowest_hz_ = 0.0, highest_hz_ = 0.0, duration_s_ = 0.0;
  int lines_ = 0;
};

}  // namespace upright::pieces
