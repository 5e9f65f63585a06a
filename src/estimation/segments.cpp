#include "segments.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

namespace {

/// What was commanded in a gap that ends at sample k is not known, and may still act for a while: through a
/// delay, and, the more of it there was, through a lag. The first sample after that while.
std::size_t resume_after_gap(const Measurement& run, std::size_t k) {
  constexpr double min_s = 0.1, max_s = 0.5;
  const double gap_s = run.time_s[k] - run.time_s[k - 1];
  const double resume_s = run.time_s[k] + std::min(min_s + 2.0 * gap_s, max_s);
  while (k + 1 < run.size() && run.time_s[k] < resume_s) ++k;
  return k;
}

void cut_run(const Measurement& run, std::size_t number, double longest_s, std::vector<Segment>& segments) {
  constexpr double largest_growth = 2.5;  // of the logarithm of an error
  constexpr double upright_rate = 5.0;    // 1/s, of a pendulum of arm's length
  double growth = 0.0;
  std::size_t first = 0;
  const std::vector<std::size_t> gaps = gaps_in(run);
  auto next_gap = gaps.begin();
  const auto close = [&](std::size_t last) {
    if (last >= first + 8) segments.push_back({number, first, last});
  };
  for (std::size_t k = 1; k < run.size(); ++k) {
    while (next_gap != gaps.end() && *next_gap < k) ++next_gap;
    const bool gap = next_gap != gaps.end() && *next_gap == k;
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

bool is_gap(const Measurement& run, std::size_t k, double period_s) {
  constexpr double longest_periods = 5.0;
  return run.time_s[k] - run.time_s[k - 1] > longest_periods * period_s ||
         std::binary_search(run.breaks.begin(), run.breaks.end(), k);
}

std::vector<std::size_t> gaps_in(const Measurement& run) {
  const double period_s = run.median_period_s();
  std::vector<std::size_t> gaps;
  for (std::size_t k = 1; k < run.size(); ++k)
    if (is_gap(run, k, period_s)) gaps.push_back(k);
  return gaps;
}

std::vector<Segment> cut_segments(const std::vector<Measurement>& runs, double longest_s) {
  std::vector<Segment> segments;
  for (std::size_t r = 0; r < runs.size(); ++r) cut_run(runs[r], r, longest_s, segments);
  return segments;
}

double largest_voltage_v(const std::vector<Measurement>& runs, const Segment& segment) {
  double largest = 0.0;
  for (std::size_t k = segment.first; k <= segment.last; ++k)
    largest = std::max(largest, std::abs(runs[segment.run].voltage_v[k]));
  return largest;
}

double largest_voltage_v(const FitData& data) {
  double largest = 0.0;
  for (const Segment& s : data.segments) largest = std::max(largest, largest_voltage_v(*data.runs, s));
  return largest;
}

std::size_t most_driven_segment(const FitData& data) {
  const auto voltage = [&](const Segment& segment) { return largest_voltage_v(*data.runs, segment); };
  return static_cast<std::size_t>(std::ranges::max_element(data.segments, {}, voltage) -
                                  data.segments.begin());
}

}  // namespace upright
