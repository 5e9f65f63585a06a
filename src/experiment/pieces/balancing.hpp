// What the kinds that balance have in common: who brings the pendulum upright, and where it is let go.
#pragma once

#include <cstdint>

#include "experiment/piece.hpp"
#include "upright/control/delay_line.hpp"

namespace upright::pieces {

/// Who brings the pendulum upright.
enum class StartBy : std::uint8_t { hand, swing_up };

class Balancing : public PieceKind {
 public:
  bool needs_pendulum() const override { return true; }
  void place(Hand& hand) const override {
    constexpr double holds_s = 2.0;
    if (start_ != StartBy::hand) return;
    hand.pose.theta_rad = theta0_rad;
    hand.holds_s = holds_s;
  }
  const char* request() const override {
    return start_ == StartBy::hand
               ? "when the cart stands in the middle, lift the pendulum upright and hold it still until it "
                 "balances"
               : "";
  }
  void set_trial(const ExperimentTrial& trial) override { delay_s_ = trial.delay_s; }

  bool balances() const override { return true; }
  bool swings_up() const override { return start_ == StartBy::swing_up; }
  double delay_s() const override { return delay_s_; }
  double patience_s() const noexcept override { return patience_s_; }

  double theta0_rad = 0.0;  ///< where the hand of a simulated rig lets go

 protected:
  static constexpr Range any_delay = Range::within(0.0, DelayLine::longest_delay_s);
  static constexpr Range release_deg = Range::within(-8.0, 8.0);
  static constexpr double usual_release_deg = 2.0;

  void start_key(PieceKeys& keys) {
    constexpr Words<2> who = {"hand", "swing_up"};
    keys.one_of("start", start_, who, StartBy::hand);
  }
  void patience_key(PieceKeys& keys) { keys.number("patience_s", patience_s_, any_duration, 60.0); }

  double delay_s_ = 0.0;  ///< of its one run

 private:
  StartBy start_ = StartBy::hand;
  double patience_s_ = 0.0;  ///< longest wait for the operator
};

}  // namespace upright::pieces
