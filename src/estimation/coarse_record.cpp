#include "coarse_record.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace upright {

namespace {

/// The largest change of the voltage within `period_s` that its mean may stand for: half of the period at one
/// voltage and half at the other moves the cart by an eighth of the difference in acceleration.
double largest_change_v(const Measurement& run, const Plant& plant, double period_s) {
  if (run.cart_locked) return std::numeric_limits<double>::infinity();
  if (!run.has_cart()) return 0.0;
  const double per_volt_m = plant.motor.force_per_volt_n / plant.cart_mass_kg * period_s * period_s / 8.0;
  return run.cart_noise_m() / std::max(std::abs(per_volt_m), std::numeric_limits<double>::min());
}

/// The samples of a run that are kept.
std::vector<std::size_t> kept_samples(const Measurement& run, const Plant& plant, double period_s,
                                      const std::vector<std::size_t>& gaps) {
  constexpr double slack_periods = 0.1;  // time stamps scatter
  const double longest_s = period_s + slack_periods * run.median_period_s();
  const double change_v = largest_change_v(run, plant, period_s);
  std::vector<std::size_t> kept = {0};
  double low_v = run.voltage_v[0], high_v = low_v;
  for (std::size_t k = 1; k < run.size(); ++k) {
    const bool next_too_late = k + 1 == run.size() || run.time_s[k + 1] - run.time_s[kept.back()] > longest_s;
    const bool at_gap = std::binary_search(gaps.begin(), gaps.end(), k) ||
                        std::binary_search(gaps.begin(), gaps.end(), k + 1);
    low_v = std::min(low_v, run.voltage_v[k]);
    high_v = std::max(high_v, run.voltage_v[k]);
    if (!next_too_late && !at_gap && high_v - low_v <= change_v) continue;
    kept.push_back(k);
    low_v = high_v = run.voltage_v[k];
  }
  return kept;
}

std::vector<double> at(const std::vector<double>& values, const std::vector<std::size_t>& kept) {
  std::vector<double> some;
  if (values.empty()) return some;
  some.reserve(kept.size());
  for (const std::size_t k : kept) some.push_back(values[k]);
  return some;
}

/// Over the time from each kept sample to the next.
std::vector<double> mean_voltage(const Measurement& run, const std::vector<std::size_t>& kept) {
  std::vector<double> means;
  means.reserve(kept.size());
  for (std::size_t i = 0; i + 1 < kept.size(); ++i) {
    double sum = 0.0;
    for (std::size_t k = kept[i]; k < kept[i + 1]; ++k)
      sum += run.voltage_v[k] * (run.time_s[k + 1] - run.time_s[k]);
    means.push_back(kept[i + 1] == kept[i] + 1 ? run.voltage_v[kept[i]]
                                               : sum / (run.time_s[kept[i + 1]] - run.time_s[kept[i]]));
  }
  means.push_back(run.voltage_v[kept.back()]);
  return means;
}

Measurement coarse_run(const Measurement& run, const Plant& plant, double period_s) {
  const std::vector<std::size_t> gaps = gaps_in(run);
  const std::vector<std::size_t> kept = kept_samples(run, plant, period_s, gaps);
  Measurement coarse = run;
  coarse.time_s = at(run.time_s, kept);
  coarse.voltage_v = mean_voltage(run, kept);
  coarse.cart_m = at(run.cart_m, kept);
  coarse.theta_rad = at(run.theta_rad, kept);
  if (!run.cart_weight.empty()) coarse.cart_weight = dwell_weights(coarse.cart_m);
  if (!run.theta_weight.empty()) coarse.theta_weight = dwell_weights(coarse.theta_rad);
  if (run.has_cart()) coarse.known_cart_noise_m = run.cart_noise_m();
  if (run.has_theta()) coarse.known_theta_noise_rad = run.theta_noise_rad();
  coarse.unfoldings.clear();
  coarse.breaks.clear();
  for (const std::size_t gap : gaps)
    coarse.breaks.push_back(
        static_cast<std::size_t>(std::lower_bound(kept.begin(), kept.end(), gap) - kept.begin()));
  return coarse;
}

}  // namespace

std::vector<Measurement> coarse_runs(const std::vector<Measurement>& runs, const Plant& plant,
                                     double period_s) {
  std::vector<Measurement> coarse;
  coarse.reserve(runs.size());
  for (const Measurement& run : runs) coarse.push_back(coarse_run(run, plant, period_s));
  return coarse;
}

std::vector<Segment> coarse_segments(const std::vector<Segment>& segments,
                                     const std::vector<Measurement>& runs,
                                     const std::vector<Measurement>& coarse) {
  constexpr std::size_t fewest_samples = 8;
  std::vector<Segment> kept;
  for (const Segment& segment : segments) {
    const std::vector<double>& fine_s = runs[segment.run].time_s;
    const std::vector<double>& coarse_s = coarse[segment.run].time_s;
    const auto first = std::lower_bound(coarse_s.begin(), coarse_s.end(), fine_s[segment.first]);
    const auto beyond = std::upper_bound(first, coarse_s.end(), fine_s[segment.last]);
    if (static_cast<std::size_t>(beyond - first) <= fewest_samples) continue;
    kept.push_back({segment.run, static_cast<std::size_t>(first - coarse_s.begin()),
                    static_cast<std::size_t>(beyond - coarse_s.begin()) - 1});
  }
  return kept;
}

}  // namespace upright
