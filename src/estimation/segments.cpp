#include "upright/estimation/segments.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

namespace {

/// What was commanded in a gap that ends at sample k is not known, and may still act for a while: through a
/// delay, and, the more of it there was, through a lag. The first sample after that while.
std::size_t resume_after_gap(const Measurement& run, std::size_t k) {
  constexpr double at_least_s = 0.1, at_most_s = 0.5;
  const double gap_s = run.time_s[k] - run.time_s[k - 1];
  const double resume_s = run.time_s[k] + std::min(at_least_s + 2.0 * gap_s, at_most_s);
  while (k + 1 < run.size() && run.time_s[k] < resume_s) ++k;
  return k;
}

void cut_run(const Measurement& run, std::size_t number, double longest_s, std::vector<Segment>& segments) {
  const double period = run.median_period_s();
  constexpr double largest_growth = 2.5;  // of the logarithm of an error
  constexpr double upright_rate = 5.0;    // 1/s, of a pendulum of arm's length
  double growth = 0.0;
  std::size_t first = 0;
  auto next_break = run.breaks.begin();
  const auto close = [&](std::size_t last) {
    if (last >= first + 8) segments.push_back({number, first, last});
  };
  for (std::size_t k = 1; k < run.size(); ++k) {
    while (next_break != run.breaks.end() && *next_break < k) ++next_break;
    const bool gap = run.time_s[k] - run.time_s[k - 1] > 5.0 * period ||
                     (next_break != run.breaks.end() && *next_break == k);
    if (run.has_theta())
      growth +=
          upright_rate * std::max(0.0, std::cos(run.theta_rad[k])) * (run.time_s[k] - run.time_s[k - 1]);
    if (gap) {
      close(k - 1);
      first = k = resume_after_gap(run, k);
      growth = 0.0;
    } else if (growth > largest_growth || run.time_s[k] - run.time_s[first] >= longest_s ||
               k + 1 == run.size()) {
      close(k);
      first = k;
      growth = 0.0;
    }
  }
}

}  // namespace

std::vector<Segment> cut_segments(const std::vector<Measurement>& runs, double longest_s) {
  std::vector<Segment> segments;
  for (std::size_t r = 0; r < runs.size(); ++r) cut_run(runs[r], r, longest_s, segments);
  return segments;
}

}  // namespace upright
