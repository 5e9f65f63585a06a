// Notices an encoder that has stopped counting while the motor balances: its counts are fresh but no longer
// true. A cable that came off looks like that, and so does an amplifier that is off or a cart that is
// blocked. Pure, without allocation; one call per computed period.
#pragma once

#include <cstdint>

namespace upright {

enum class StuckEncoder : std::uint8_t { none, cart, pendulum };

/// What no healthy rig does between two counts of an encoder. An IP02's cart breaks away at about 0.5 V; the
/// upright pendulum falls away from any angle with a time constant of 0.2 s, so that no count lasts for long.
struct EncoderWatchLimits {
  // The cart: silent for so long, while the voltage beyond `cart_moves_above_v` adds up to this impulse.
  double cart_moves_above_v = 1.5;
  double cart_impulse_vs = 0.03;
  double cart_silent_s = 0.05;
  // The pendulum: silent for so long, while the cart's velocity changed by so much.
  double pendulum_silent_s = 0.1;
  double velocity_change_mps = 0.2;
  // The cart again, for one that drifts off slowly: silent for so long, while the pendulum counted in so many
  // periods. The other way round that proves nothing, for a cart creeps home under a pendulum that stays
  // within a count.
  double cart_at_rest_s = 1.0;
  int pendulum_counts = 20;
};

/// One period with fresh counts, in which the loop balances.
struct WatchedPeriod {
  std::uint64_t tick = 0;
  double time_s = 0.0;
  std::int64_t cart_counts = 0, pendulum_counts = 0;
  double cart_velocity_mps = 0.0;  ///< estimated
  double voltage_v = 0.0;          ///< applied from this period on
};

class EncoderWatch {
 public:
  explicit EncoderWatch(const EncoderWatchLimits& limits = {}) noexcept : limits_(limits) {}

  StuckEncoder step(const WatchedPeriod& period) noexcept;
  /// Forgets what came before: for periods in which nothing balances.
  void reset() noexcept { started_ = false; }
  /// The first period in which that encoder did not count.
  std::uint64_t silent_since(StuckEncoder encoder) const noexcept {
    return (encoder == StuckEncoder::cart ? cart_ : pendulum_).since_tick + 1;
  }

 private:
  /// What happened since an encoder's last count.
  struct Silence {
    std::int64_t counts = 0;
    std::uint64_t since_tick = 0;
    double since_s = 0.0;
    double impulse_vs = 0.0;
    double slowest_mps = 0.0, fastest_mps = 0.0;
    int pendulum_counted = 0;
  };
  static Silence begin(const WatchedPeriod& period, std::int64_t counts) noexcept;
  void go_on(Silence& silence, const WatchedPeriod& period, bool pendulum_counted) const noexcept;

  EncoderWatchLimits limits_;
  Silence cart_, pendulum_;
  double last_s_ = 0.0, last_v_ = 0.0;
  bool started_ = false;
};

}  // namespace upright
