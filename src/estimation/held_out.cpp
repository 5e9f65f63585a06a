#include "held_out.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace upright {

namespace {

/// The excitation of a stretch: root mean square speed of the cart and of a pendulum of arm's length beside
/// it.
double excitation_of(const Measurement& run, const Segment& stretch) {
  constexpr double arm_m = 0.3;
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(0.02 / run.median_period_s()));
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
/// their excitation, so that the fit need not answer for motions beyond those it saw, in whatever order they
/// come.
std::vector<std::size_t> choose_held_out(const std::vector<Measurement>& runs,
                                         const std::vector<Segment>& stretches, HeldOut which) {
  std::vector<double> excitation;
  excitation.reserve(stretches.size());
  for (const Segment& stretch : stretches) excitation.push_back(excitation_of(runs[stretch.run], stretch));
  std::vector<std::size_t> order(stretches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return excitation[a] < excitation[b]; });
  std::vector<std::size_t> held;
  const bool middle = which != HeldOut::other;
  if (order.size() == 2) held = {order[middle ? 0 : 1]};
  for (std::size_t i = middle ? 1 : 0; i < order.size() && order.size() > 2; i += 3) held.push_back(order[i]);
  std::sort(held.begin(), held.end());
  return held;
}

}  // namespace

DataSplit split(const std::vector<Measurement>& runs, HeldOut which) {
  const std::vector<Segment> segments = cut_segments(runs);
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
    chosen = choose_held_out(runs, one_run ? segments : whole, which);
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

}  // namespace upright
