#include "thinning.hpp"

#include <algorithm>

namespace upright {

namespace {

std::size_t samples_in(const std::vector<Segment>& segments) {
  std::size_t count = 0;
  for (const Segment& s : segments) count += s.last - s.first + 1;
  return count;
}

}  // namespace

std::vector<Segment> moving_segments(const std::vector<Measurement>& runs) {
  std::vector<Segment> kept;
  for (const Segment& s : cut_segments(runs)) {
    const Measurement& run = runs[s.run];
    const auto range = [&](const std::vector<double>& values) {
      const auto [low, high] = std::minmax_element(values.begin() + static_cast<std::ptrdiff_t>(s.first),
                                                   values.begin() + static_cast<std::ptrdiff_t>(s.last) + 1);
      return *high - *low;
    };
    const bool cart = run.has_cart() && range(run.cart_m) > 6.0 * std::max(run.cart_resolution_m, 1e-9);
    const bool decay = run.cart_locked && run.has_theta();
    if (cart || decay) kept.push_back(s);
  }
  return kept;
}

std::vector<Segment> thinned(const std::vector<Segment>& segments, double max_samples) {
  const double part = max_samples / static_cast<double>(samples_in(segments));
  if (part >= 1.0) return segments;
  std::vector<Segment> kept;
  double owed = 0.5;
  for (const Segment& s : segments) {
    owed += part;
    if (owed < 1.0) continue;
    owed -= 1.0;
    kept.push_back(s);
  }
  return kept;
}

}  // namespace upright
