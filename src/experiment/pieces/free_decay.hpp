// free_decay: the pendulum is let go from an angle while somebody holds the cart.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "experiment/piece.hpp"

namespace upright::pieces {

class FreeDecay final : public PieceOf<FreeDecay> {
 public:
  static constexpr const char* kind = "free_decay";

  void keys(PieceKeys& keys) override {
    keys.angle("angle_deg", angle_rad_, Range::within(5.0, 170.0), required);
    keys.number("duration_s", duration_s_, any_duration, required);
    keys.number("patience_s", patience_s_, any_duration, 60.0);
  }
  PieceTime time() const override { return {duration_s_}; }

  bool needs_pendulum() const override { return true; }
  void place(Hand& hand) const override {
    hand.pose.theta_rad = std::numbers::pi - angle_rad_;
    hand.cart_held = true;
    hand.holds_s = 0.7;
  }
  const char* request() const override {
    return "hold the cart, lift the pendulum aside and keep it still; let go after a second";
  }

  std::vector<Stretch> stretches(const ScriptContext&) const override { return {{0.0, 0.0, duration_s_}}; }
  bool is_driven() const noexcept override { return false; }
  Opening opening() const noexcept override { return Opening::waiting; }
  double patience_s() const noexcept override { return patience_s_; }
  bool is_ready(const ControlState& now, const ScriptContext& context) const noexcept override {
    return std::abs(hanging_lean(context, now)) > 0.8 * angle_rad_ &&
           std::abs(now.pendulum_rate_radps) < rest_radps;
  }

  double angle_rad() const noexcept { return angle_rad_; }  ///< from hanging

 private:
  double angle_rad_ = 0.0, duration_s_ = 0.0, patience_s_ = 0.0;
};

}  // namespace upright::pieces
