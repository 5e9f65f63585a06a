#include "upright/control/encoder_watch.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

EncoderWatch::Silence EncoderWatch::begin(const WatchedPeriod& period, std::int64_t counts) noexcept {
  Silence silence;
  silence.counts = counts;
  silence.since_tick = period.tick;
  silence.since_s = period.time_s;
  silence.slowest_mps = silence.fastest_mps = period.cart_velocity_mps;
  return silence;
}

void EncoderWatch::go_on(Silence& silence, const WatchedPeriod& period,
                         bool pendulum_counted) const noexcept {
  const double beyond_v = std::max(0.0, std::abs(last_v_) - limits_.cart_moves_above_v);
  silence.impulse_vs += std::copysign(beyond_v, last_v_) * (period.time_s - last_s_);
  silence.slowest_mps = std::min(silence.slowest_mps, period.cart_velocity_mps);
  silence.fastest_mps = std::max(silence.fastest_mps, period.cart_velocity_mps);
  if (pendulum_counted) ++silence.pendulum_counted;
}

StuckEncoder EncoderWatch::step(const WatchedPeriod& period) noexcept {
  const bool cart_counted = !started_ || period.cart_counts != cart_.counts;
  const bool pendulum_counted = !started_ || period.pendulum_counts != pendulum_.counts;
  if (cart_counted)
    cart_ = begin(period, period.cart_counts);
  else
    go_on(cart_, period, pendulum_counted);
  if (pendulum_counted)
    pendulum_ = begin(period, period.pendulum_counts);
  else
    go_on(pendulum_, period, false);
  started_ = true;
  last_s_ = period.time_s;
  last_v_ = period.voltage_v;

  const bool drifting = period.time_s - cart_.since_s >= limits_.cart_at_rest_s &&
                        cart_.pendulum_counted >= limits_.pendulum_counts;
  const bool driven = period.time_s - cart_.since_s >= limits_.cart_silent_s &&
                      std::abs(cart_.impulse_vs) >= limits_.cart_impulse_vs;
  if (driven || drifting) return StuckEncoder::cart;
  const bool shaken = period.time_s - pendulum_.since_s >= limits_.pendulum_silent_s &&
                      pendulum_.fastest_mps - pendulum_.slowest_mps >= limits_.velocity_change_mps;
  return shaken ? StuckEncoder::pendulum : StuckEncoder::none;
}

}  // namespace upright
