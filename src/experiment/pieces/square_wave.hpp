// square_wave: of the voltage, about the middle.
#pragma once

#include <cmath>
#include <vector>

#include "experiment/piece.hpp"

namespace upright::pieces {

class SquareWave final : public PieceOf<SquareWave> {
 public:
  static constexpr const char* kind = "square_wave";

  void keys(PieceKeys& keys) override {
    keys.voltage("amplitude_v", amplitude_v_);
    keys.number("period_s", period_s_, any_period, required);
    keys.number("duration_s", duration_s_, any_duration, required);
  }
  bool may_fit() const override { return true; }
  PieceTime time() const override { return {duration_s_}; }

  std::vector<Stretch> stretches(const ScriptContext&) const override {
    return {{0.0, amplitude_v_, duration_s_}};
  }
  bool resumes() const noexcept override { return true; }
  double voltage_v(const Excitation& at) noexcept override {
    // A quarter of a period first, so that the cart swings about where it starts.
    const double turns = at.acted_s / period_s_ + 0.25;
    return turns - std::floor(turns) < 0.5 ? at.stretch.voltage_v : -at.stretch.voltage_v;
  }

 private:
  double amplitude_v_ = 0.0, period_s_ = 0.0, duration_s_ = 0.0;
};

}  // namespace upright::pieces
