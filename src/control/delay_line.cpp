#include "upright/control/delay_line.hpp"

#include <algorithm>
#include <cmath>

#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

DelayLine::DelayLine(double delay_s, double period_s) : delay_s_(delay_s) {
  if (!(period_s > 0.0) || !std::isfinite(period_s))
    throw ConfigError("the sampling period is " + exact_text(period_s) + " s: use a value above 0");
  if (!(delay_s >= 0.0 && delay_s <= longest_delay_s && delay_s / period_s <= longest_delay_periods))
    throw ConfigError("the delay is " + exact_text(delay_s) + " s: set delay_s to a value from 0 to " +
                      exact_text(longest_delay_s) + " s");
  constexpr double same_period = 1e-9;
  const double periods = delay_s / period_s;
  const double nearest = std::round(periods);
  if (std::abs(periods - nearest) <= same_period * std::max(1.0, nearest)) {
    whole_ = static_cast<std::size_t>(nearest);
  } else {
    whole_ = static_cast<std::size_t>(periods);
    fraction_ = periods - static_cast<double>(whole_);
  }
  ring_.resize(whole_ + 2);
}

void DelayLine::start(const ControlState& state) noexcept {
  for (ControlState& slot : ring_) slot = state;
  newest_ = 0;
}

void DelayLine::push(const ControlState& state) noexcept {
  newest_ = newest_ + 1 == ring_.size() ? 0 : newest_ + 1;
  ring_[newest_] = state;
}

const ControlState& DelayLine::back(std::size_t periods) const noexcept {
  return ring_[newest_ >= periods ? newest_ - periods : newest_ + ring_.size() - periods];
}

ControlState DelayLine::delayed() const noexcept {
  const ControlState& later = back(whole_);
  if (fraction_ == 0.0) return later;
  const ControlState& earlier = back(whole_ + 1);
  const auto between = [f = fraction_](double a, double b) { return a + f * (b - a); };
  return {between(later.cart_m, earlier.cart_m),
          between(later.theta_rad, earlier.theta_rad),
          between(later.cart_velocity_mps, earlier.cart_velocity_mps),
          between(later.pendulum_rate_radps, earlier.pendulum_rate_radps),
          between(later.motor_v, earlier.motor_v),
          between(later.cart_force_n, earlier.cart_force_n)};
}

}  // namespace upright
