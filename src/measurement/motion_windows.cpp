#include "motion_windows.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace upright {

namespace {

constexpr std::size_t min_samples = 6;  ///< of a window: twice what a parabola needs
constexpr std::size_t max_windows = 4000;

}  // namespace

MotionWindows::MotionWindows(const std::vector<double>& time_s, const std::vector<std::size_t>& breaks,
                             double length_s, double margin_s)
    : time_s_(time_s), length_s_(length_s) {
  const double duration_s = time_s.back() - time_s.front(), whole_s = length_s + 2.0 * margin_s;
  const double step_s = std::max(0.5 * length_s, duration_s / max_windows);
  const double period_s = duration_s / static_cast<double>(time_s.size() - 1);
  auto next_break = breaks.begin();
  std::size_t first = 0;
  // Counted: where stamps are huge, a step added to them may be nothing.
  for (std::size_t number = 0; number < 2 * max_windows; ++number) {
    const double from_s = time_s.front() + step_s * static_cast<double>(number);
    if (from_s + whole_s > time_s.back()) break;
    while (time_s[first] < from_s) ++first;
    std::size_t last = first;
    const double longest_gap_s = std::max(0.3 * length_s, 5.0 * period_s);
    bool whole = time_s[first] - from_s < longest_gap_s;
    while (last + 1 < time_s.size() && time_s[last + 1] <= from_s + whole_s) {
      ++last;
      whole = whole && time_s[last] - time_s[last - 1] < longest_gap_s;
    }
    whole = whole && from_s + whole_s - time_s[last] < longest_gap_s;
    while (next_break != breaks.end() && *next_break <= first) ++next_break;
    whole = whole && (next_break == breaks.end() || *next_break > last);
    while (first < last && time_s[first] < from_s + margin_s) ++first;
    while (last > first && time_s[last] > from_s + margin_s + length_s) --last;
    if (whole && last - first + 1 >= min_samples) windows_.emplace_back(first, last);
    while (first > 0 && time_s[first - 1] >= from_s) --first;
  }
}

std::pair<std::size_t, std::size_t> MotionWindows::moved(std::size_t window, double by_s) const {
  auto [first, last] = windows_[window];
  if (by_s == 0.0) return {first, last};
  const double from_s = time_s_[first] + by_s, to_s = time_s_[last] + by_s;
  while (first > 0 && time_s_[first - 1] >= from_s) --first;
  while (first + 1 < time_s_.size() && time_s_[first] < from_s) ++first;
  while (last + 1 < time_s_.size() && time_s_[last + 1] <= to_s) ++last;
  while (last > first && time_s_[last] > to_s) --last;
  return {first, last};
}

WindowedMotion MotionWindows::motion(const std::vector<double>& values, double later_s) const {
  WindowedMotion result;
  double left = 0.0, freedom = 0.0, spread = 0.0;
  for (std::size_t j = 0; j < windows_.size(); ++j) {
    const double middle_s = 0.5 * (time_s_[windows_[j].first] + time_s_[windows_[j].second]) + later_s;
    const auto [first, last] = moved(j, later_s);
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    double squares = 0.0;
    for (std::size_t k = first; k <= last; ++k) {
      const double u = 2.0 * (time_s_[k] - middle_s) / length_s_, y = values[k] - values[first];
      const Eigen::Vector3d basis(1.0, u, u * u);
      h += basis * basis.transpose();
      g += basis * y;
      squares += y * y;
    }
    const Eigen::Matrix3d inverse = h.inverse();
    const Eigen::Vector3d p = inverse * g;
    const double to_rate = 2.0 / length_s_, to_acceleration = 2.0 * to_rate * to_rate;
    result.level.push_back(values[first] + p[0]);
    result.rate.push_back(p[1] * to_rate);
    result.acceleration.push_back(p[2] * to_acceleration);
    left += std::max(squares - p.dot(g), 0.0);
    freedom += static_cast<double>(last - first + 1) - 3.0;
    spread += inverse(2, 2) * to_acceleration * to_acceleration;
  }
  if (!windows_.empty())
    result.acceleration_noise = std::sqrt(left / freedom * spread / static_cast<double>(windows_.size()));
  return result;
}

std::vector<double> MotionWindows::held(const std::vector<double>& values, double earlier_s) const {
  std::vector<double> result;
  for (const auto& [from, to] : windows_) {
    const double middle_s = 0.5 * (time_s_[from] + time_s_[to]) - earlier_s;
    std::size_t k = from;
    while (k > 0 && time_s_[k] > middle_s - 0.5 * length_s_) --k;
    while (k + 1 < time_s_.size() && time_s_[k + 1] <= middle_s - 0.5 * length_s_) ++k;
    double sum = 0.0, weights = 0.0;
    for (; k + 1 < time_s_.size() && time_s_[k] < middle_s + 0.5 * length_s_; ++k) {
      const double held_s = time_s_[k + 1] - time_s_[k];
      const double u = 2.0 * (time_s_[k] + 0.5 * held_s - middle_s) / length_s_;
      if (std::abs(u) >= 1.0) continue;
      const double weight = held_s * (1.0 - u * u) * (1.0 - u * u);
      sum += weight * values[k];
      weights += weight;
    }
    result.push_back(weights > 0.0 ? sum / weights : values[from]);
  }
  return result;
}

}  // namespace upright
