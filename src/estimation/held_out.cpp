#include "held_out.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "upright/base/error.hpp"

namespace upright {

namespace {

double excitation_of(const Measurement& run, const Segment& stretch, double arm_m, double speed_window_s) {
  const auto stride =
      std::max<std::size_t>(1, static_cast<std::size_t>(speed_window_s / run.median_period_s()));
  double sum = 0.0, count = 0.0;
  for (std::size_t k = stretch.first + stride; k <= stretch.last; k += stride) {
    const double dt = run.time_s[k] - run.time_s[k - stride];
    const double cart = run.has_cart() ? (run.cart_m[k] - run.cart_m[k - stride]) / dt : 0.0;
    const double tip = run.has_theta() ? arm_m * (run.theta_rad[k] - run.theta_rad[k - stride]) / dt : 0.0;
    sum += cart * cart + tip * tip;
    count += 1.0;
  }
  return std::sqrt(sum / std::max(count, 1.0));
}

/// Which stretches to hold out, a third of them: by default the middle one of each three in the order of
/// their excitation, in whatever order they come. The fit need not answer for motions beyond those it saw, so
/// the most excited one is not held out: where three are not complete, it is the one before.
std::vector<std::size_t> choose_held_out(const std::vector<double>& excitation, HeldOut which) {
  std::vector<std::size_t> order(excitation.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return excitation[a] < excitation[b]; });
  const std::size_t count = order.size(), place = which == HeldOut::other ? 0 : 1;
  if (count < 2) return {};
  if (count == 2) return {order[1 - place]};
  std::vector<std::size_t> held;
  for (std::size_t first = 0; first + place < count; first += 3)
    held.push_back(order[first + 3 > count ? first + place - 1 : first + place]);
  std::sort(held.begin(), held.end());
  return held;
}

}  // namespace

double sample_count(const FitData& data) {
  double count = 0.0;
  for (const Segment& s : data.segments) count += static_cast<double>(s.last - s.first + 1);
  return count;
}

DataSplit split(const std::vector<Measurement>& runs, HeldOut which, double arm_m, double speed_window_s) {
  const std::vector<Segment> segments = cut_segments(runs);
  if (segments.empty())
    throw ConfigError("no part of the data is long enough to simulate: record longer runs");
  DataSplit result;
  result.train.runs = result.held.runs = &runs;
  std::vector<Segment> whole;
  whole.reserve(runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r) whole.push_back({r, 0, runs[r].size() - 1});
  const bool one_run = runs.size() == 1;
  std::vector<std::size_t> chosen;
  if (one_run && which == HeldOut::end) {
    for (std::size_t s = segments.size() - segments.size() / 3; s < segments.size(); ++s) chosen.push_back(s);
  } else {
    std::vector<double> excitation;
    for (const Segment& stretch : one_run ? segments : whole)
      excitation.push_back(excitation_of(runs[stretch.run], stretch, arm_m, speed_window_s));
    chosen = choose_held_out(excitation, which);
  }
  std::vector<Segment>&train = result.train.segments, &held = result.held.segments;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const bool out = std::binary_search(chosen.begin(), chosen.end(), one_run ? s : segments[s].run);
    (out ? held : train).push_back(segments[s]);
  }
  if (!one_run) result.held_out_runs = chosen;
  if (held.empty() && train.size() > 1) {
    held.push_back(train.back());
    train.pop_back();
  }
  return result;
}

bool largest_voltage_is_held_out(const DataSplit& data) {
  return !data.held_out_runs.empty() && largest_voltage_v(data.held) > largest_voltage_v(data.train);
}

std::array<std::vector<std::size_t>, 2> halves(const FitData& data, double arm_m, double speed_window_s) {
  const std::vector<Measurement>& runs = *data.runs;
  const std::vector<Segment>& segments = data.segments;
  std::vector<std::size_t> order(segments.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(segments[a].run, segments[a].first) < std::pair(segments[b].run, segments[b].first);
  });
  std::array<std::vector<std::size_t>, 2> parts;
  if (order.empty()) return parts;
  if (segments[order.front()].run == segments[order.back()].run) {
    for (std::size_t i = 0; i < order.size(); ++i) parts[i % 2].push_back(order[i]);
    return parts;
  }
  std::vector<std::pair<double, std::size_t>> excitation;
  for (std::size_t r = 0; r < runs.size(); ++r)
    if (std::any_of(order.begin(), order.end(), [&](std::size_t s) { return segments[s].run == r; }))
      excitation.emplace_back(excitation_of(runs[r], {r, 0, runs[r].size() - 1}, arm_m, speed_window_s), r);
  std::stable_sort(excitation.begin(), excitation.end());
  std::vector<std::size_t> part_of(runs.size(), 0);
  for (std::size_t i = 0; i < excitation.size(); ++i) part_of[excitation[i].second] = i % 2;
  for (const std::size_t s : order) parts[part_of[segments[s].run]].push_back(s);
  return parts;
}

}  // namespace upright
