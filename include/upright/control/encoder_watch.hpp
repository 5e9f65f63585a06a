// Notices an encoder that has stopped counting while the motor balances: its counts are fresh but no longer
// true. A cable that came off looks like that, and so does an amplifier that is off or a cart that is
// blocked. Pure, without allocation, bounded; one call per computed period.
//
// The cart: since its last count, carts at rest are moved by the voltages that were applied, one for each
// corner of what is assumed about friction and lag. The encoder is stuck when every one of them has travelled
// several counts, twice. A cart that rests because of its friction is thus never accused.
//
// The pendulum: while its angle is constant, the cart's acceleration is g tan(theta), a constant, but for
// friction in the pivot and what hides within a count. The encoder is stuck when the cart leaves every
// parabola by more than that.
#pragma once

#include <array>
#include <cstdint>

#include "upright/control/encoder_assumptions.hpp"

namespace upright {

enum class StuckEncoder : std::uint8_t { none, cart, pendulum };

/// One period with fresh counts, in which the loop balances.
struct WatchedPeriod {
  std::uint64_t tick = 0;
  double time_s = 0.0;
  std::int64_t cart_counts = 0, pendulum_counts = 0;
  double cart_m = 0.0;     ///< scaled and unwrapped
  double voltage_v = 0.0;  ///< applied from this period on
};

/// A cart at rest that the applied voltages move, with one friction and one lag. Motor and friction only: the
/// upright pendulum's push on the cart is far below the uncertainty of the friction.
class DrivenCart {
 public:
  DrivenCart() = default;
  DrivenCart(const EncoderAssumptions& assumptions, double breakaway_v, double lag_s);

  /// At rest again; the motor's force goes on.
  void rest() noexcept { velocity_mps_ = travel_m_ = 0.0; }
  /// Moves on under `voltage_v`; returns the distance from where it rested.
  double step(double voltage_v, double duration_s) noexcept;

 private:
  double acceleration_mps2_per_v_ = 0.0, damping_v_per_mps_ = 0.0, breakaway_v_ = 0.0, lag_s_ = 0.0;
  double acting_v_ = 0.0, velocity_mps_ = 0.0, travel_m_ = 0.0;
};

/// The latest positions of the cart as means over short intervals, and how far they are from a parabola.
class CartPath {
 public:
  void clear() noexcept { count_ = filling_ = 0; }
  /// True when an interval was completed.
  bool add(double time_s, double cart_m) noexcept;
  /// Root mean square distance from the best parabola [m]; 0 with fewer than `fewest` intervals.
  double rms_from_parabola_m() const noexcept;
  double duration_s() const noexcept;

 private:
  static constexpr std::size_t most = 32, fewest = 8;
  static constexpr double interval_s = 0.01;
  struct Point {
    double time_s = 0.0, cart_m = 0.0;
  };
  std::array<Point, most> points_{};
  std::size_t count_ = 0, next_ = 0;
  Point sum_;
  double first_s_ = 0.0;
  int filling_ = 0;
};

class EncoderWatch {
 public:
  /// `m_per_count` and `rad_per_count`: what a count of either encoder means.
  EncoderWatch(const EncoderAssumptions& assumptions, double m_per_count, double rad_per_count) noexcept;

  StuckEncoder step(const WatchedPeriod& period) noexcept;
  /// Forgets what came before: for periods in which nothing balances.
  void reset() noexcept { started_ = false; }
  /// The first period in which that encoder did not count.
  std::uint64_t silent_since(StuckEncoder encoder) const noexcept {
    return (encoder == StuckEncoder::cart ? cart_ : pendulum_).since_tick + 1;
  }

 private:
  /// Since when an encoder has not counted.
  struct Silence {
    std::int64_t counts = 0;
    std::uint64_t since_tick = 0;
    double since_s = 0.0;
  };
  /// One of the carts that may be there, and how often it has left its place unseen.
  struct Hypothesis {
    DrivenCart cart;
    int departures = 0;
  };
  bool cart_is_stuck(const WatchedPeriod& period, bool counted) noexcept;
  bool pendulum_is_stuck(const WatchedPeriod& period, bool counted) noexcept;
  double parabola_tolerance_m() const noexcept;

  EncoderAssumptions assumptions_;
  double unseen_m_, rad_per_count_, m_per_count_;
  std::array<Hypothesis, 9> hypotheses_;
  CartPath path_;
  Silence cart_, pendulum_;
  double moved_since_s_ = 0.0;  ///< since when every hypothesis has moved
  bool every_moved_ = false;
  double last_s_ = 0.0, last_v_ = 0.0;
  bool started_ = false;
};

}  // namespace upright
