#include "encoder_watch.hpp"

#include <algorithm>
#include <cmath>

#include "upright/model/elementary.hpp"

namespace upright {

namespace {

constexpr double gravity_mps2 = 9.81;
/// Counts that a cart may move beyond `unseen_travel_m` before its encoder must have counted: one for the
/// place within a count, one for its hysteresis.
constexpr double counts_within_quantum = 2.0;
/// How often each hypothetical cart must have left its place: once can be a matter of timing.
constexpr int departures_for_proof = 2;
/// Silence for less than this proves nothing: periods may be lost and readings late.
constexpr double min_silence_s = 0.05;

double between(const Bounds& bounds, int third) noexcept {
  return bounds.low + 0.5 * third * (bounds.high - bounds.low);
}

}  // namespace

DrivenCart::DrivenCart(const EncoderAssumptions& assumptions, double breakaway_v, double lag_s)
    : acceleration_mps2_per_v_(assumptions.acceleration_mps2_per_v),
      damping_v_per_mps_(assumptions.damping_v_per_mps),
      breakaway_v_(breakaway_v),
      lag_s_(lag_s) {}

double DrivenCart::step(double voltage_v, double duration_s) noexcept {
  acting_v_ += (voltage_v - acting_v_) * (lag_s_ > 0.0 ? -elementary::expm1(-duration_s / lag_s_) : 1.0);
  if (velocity_mps_ == 0.0 && std::abs(acting_v_) <= breakaway_v_) return std::abs(travel_m_);
  const double direction = velocity_mps_ != 0.0 ? velocity_mps_ : acting_v_;
  const double driving_v = acting_v_ - std::copysign(breakaway_v_, direction);
  // Implicit in the damping, so that any period is stable.
  const double before_mps = velocity_mps_;
  velocity_mps_ = (before_mps + acceleration_mps2_per_v_ * driving_v * duration_s) /
                  (1.0 + acceleration_mps2_per_v_ * damping_v_per_mps_ * duration_s);
  if (before_mps * velocity_mps_ < 0.0) velocity_mps_ = 0.0;
  travel_m_ += velocity_mps_ * duration_s;
  return std::abs(travel_m_);
}

bool CartPath::add(double time_s, double cart_m) noexcept {
  if (filling_ == 0) {
    first_s_ = time_s;
    sum_ = {};
  }
  sum_.time_s += time_s;
  sum_.cart_m += cart_m;
  ++filling_;
  if (time_s - first_s_ < interval_s) return false;
  points_[next_] = {sum_.time_s / filling_, sum_.cart_m / filling_};
  next_ = (next_ + 1) % max_points;
  count_ = std::min(count_ + 1, max_points);
  filling_ = 0;
  return true;
}

double CartPath::duration_s() const noexcept {
  if (count_ < min_points) return 0.0;
  return points_[(next_ + max_points - 1) % max_points].time_s -
         points_[(next_ + max_points - count_) % max_points].time_s;
}

double CartPath::rms_from_parabola_m() const noexcept {
  const double duration = duration_s();
  if (duration <= 0.0) return 0.0;
  // 1, t and t^2 made orthogonal on the points, as they come; their part in the positions is taken away.
  const Point latest = points_[(next_ + max_points - 1) % max_points];
  std::array<std::array<double, max_points>, 3> basis;
  std::array<double, max_points> rest;
  const auto dot = [n = count_](const auto& a, const auto& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) sum += a[i] * b[i];
    return sum;
  };
  for (std::size_t i = 0; i < count_; ++i) {
    const Point& point = points_[(next_ + max_points - count_ + i) % max_points];
    const double t = (point.time_s - latest.time_s) / duration + 0.5;
    basis[0][i] = 1.0;
    basis[1][i] = t;
    basis[2][i] = t * t;
    rest[i] = point.cart_m - latest.cart_m;
  }
  for (std::size_t k = 0; k < basis.size(); ++k) {
    for (std::size_t j = 0; j < k; ++j) {
      const double share = dot(basis[k], basis[j]) / dot(basis[j], basis[j]);
      for (std::size_t i = 0; i < count_; ++i) basis[k][i] -= share * basis[j][i];
    }
    const double share = dot(rest, basis[k]) / dot(basis[k], basis[k]);
    for (std::size_t i = 0; i < count_; ++i) rest[i] -= share * basis[k][i];
  }
  return std::sqrt(dot(rest, rest) / static_cast<double>(count_));
}

EncoderWatch::EncoderWatch(const EncoderAssumptions& assumptions, double m_per_count,
                           double rad_per_count) noexcept
    : assumptions_(assumptions),
      unseen_m_(assumptions.unseen_travel_m + counts_within_quantum * m_per_count),
      rad_per_count_(rad_per_count),
      m_per_count_(m_per_count) {
  for (int i = 0; i < 9; ++i)
    hypotheses_[static_cast<std::size_t>(i)].cart =
        DrivenCart(assumptions, between(assumptions.breakaway_v, i / 3),
                   between({0.0, assumptions.largest_lag_s}, i % 3));
}

bool EncoderWatch::cart_is_stuck(const WatchedPeriod& period, bool counted) noexcept {
  if (!started_ || counted) {
    every_moved_ = false;
    for (Hypothesis& hypothesis : hypotheses_) {
      hypothesis.departures = 0;
      hypothesis.cart.rest();
    }
  }
  const double duration_s = started_ ? period.time_s - last_s_ : 0.0;
  bool every_moved = true;
  for (Hypothesis& hypothesis : hypotheses_) {
    if (hypothesis.cart.step(last_v_, duration_s) > unseen_m_ && !counted) {
      ++hypothesis.departures;
      hypothesis.cart.rest();
    }
    every_moved = every_moved && hypothesis.departures >= departures_for_proof;
  }
  if (every_moved && !every_moved_) moved_since_s_ = period.time_s;
  every_moved_ = every_moved;
  // What the hypothesis without lag does at once, the real cart may do later.
  return every_moved && period.time_s - moved_since_s_ >= assumptions_.largest_lag_s &&
         period.time_s - cart_.since_s >= min_silence_s;
}

double EncoderWatch::parabola_tolerance_m() const noexcept {
  const double duration_s = path_.duration_s();
  // An angle that varies within a count, through the length and through gravity; friction in the pivot that
  // changes its sign halfway leaves 1/16 of its path.
  const double half_count = 0.5 * rad_per_count_;
  const double quantum_m = half_count * assumptions_.longest_pendulum_m;
  const double hidden_mps2 = gravity_mps2 * half_count + assumptions_.pivot_friction_mps2;
  return quantum_m + hidden_mps2 * duration_s * duration_s / 16.0 + counts_within_quantum * m_per_count_;
}

bool EncoderWatch::pendulum_is_stuck(const WatchedPeriod& period, bool counted) noexcept {
  if (!started_ || counted) path_.clear();
  return path_.add(period.time_s, period.cart_m) && path_.rms_from_parabola_m() > parabola_tolerance_m();
}

StuckEncoder EncoderWatch::step(const WatchedPeriod& period) noexcept {
  const bool cart_counted = !started_ || period.cart_counts != cart_.counts;
  const bool pendulum_counted = !started_ || period.pendulum_counts != pendulum_.counts;
  if (cart_counted) cart_ = {period.cart_counts, period.tick, period.time_s};
  if (pendulum_counted) pendulum_ = {period.pendulum_counts, period.tick, period.time_s};
  const bool cart_stuck = cart_is_stuck(period, cart_counted);
  const bool pendulum_stuck = pendulum_is_stuck(period, pendulum_counted);
  started_ = true;
  last_s_ = period.time_s;
  last_v_ = period.voltage_v;
  if (cart_stuck) return StuckEncoder::cart;
  return pendulum_stuck ? StuckEncoder::pendulum : StuckEncoder::none;
}

}  // namespace upright
