// observe: zero volts; whatever the operator does is logged.
#pragma once

#include <vector>

#include "experiment/piece.hpp"

namespace upright::pieces {

class Observe final : public PieceOf<Observe> {
 public:
  static constexpr const char* kind = "observe";

  void keys(PieceKeys& keys) override {
    keys.number("duration_s", duration_s_, any_duration, required);
    keys.number("simulated_push_mps", push_mps_, Range::within(-2.0, 2.0), 0.0);
    keys.flag("amplifier_off", amplifier_off_);
  }
  const char* key_for_hands() const override { return amplifier_off_ ? "amplifier_off" : nullptr; }
  PieceTime time() const override { return {duration_s_}; }

  void place(Hand& hand) const override {
    hand.amplifier_off = amplifier_off_;
    hand.push_mps = push_mps_;
  }

  std::vector<Stretch> stretches(const ScriptContext&) const override { return {{0.0, 0.0, duration_s_}}; }
  bool is_driven() const noexcept override { return false; }
  Opening opening() const noexcept override { return Opening::at_once; }

 private:
  double duration_s_ = 0.0;
  double push_mps_ = 0.0;  ///< what the hand of a simulated rig gives the cart
  bool amplifier_off_ = false;
};

}  // namespace upright::pieces
