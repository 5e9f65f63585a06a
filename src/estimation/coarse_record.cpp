#include "coarse_record.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "segments.hpp"

namespace upright {

namespace {

/// How far the cart gets from where the mean voltage of these samples takes it until the sample `end`, if
/// only the motor and its mass count: the difference, integrated twice.
double shift_by_mean_m(const Measurement& run, double accelerates_mps2_per_v, std::size_t first,
                       std::size_t end) {
  double impulse_vs = 0.0, lever_vs2 = 0.0;  // of the voltage, about the end
  for (std::size_t k = first; k < end; ++k) {
    const double held_s = run.time_s[k + 1] - run.time_s[k];
    impulse_vs += run.voltage_v[k] * held_s;
    lever_vs2 += run.voltage_v[k] * held_s * (run.time_s[end] - run.time_s[k] - 0.5 * held_s);
  }
  const double of_mean_vs2 = 0.5 * impulse_vs * (run.time_s[end] - run.time_s[first]);
  return accelerates_mps2_per_v * (lever_vs2 - of_mean_vs2);
}

/// Whether the cart slides in one direction all the time, whatever these voltages do: dry friction does not
/// follow the mean of a voltage at which the cart sticks and slips in turn.
bool slides_on(const Measurement& run, double accelerates_mps2_per_v, double change_v, std::size_t first,
               std::size_t end) {
  const double time_s = run.time_s[end] - run.time_s[first];
  const double two_readings_m = 2.0 * std::sqrt(12.0) * run.cart_noise_m();
  return std::abs(run.cart_m[end] - run.cart_m[first]) >
         accelerates_mps2_per_v * change_v * time_s * time_s + two_readings_m;
}

/// Whether the mean voltage may stand for the samples from `first` to before `end`.
bool may_replace(const Measurement& run, double accelerates_mps2_per_v, double largest_shift,
                 std::size_t first, std::size_t end) {
  const auto from = run.voltage_v.begin();
  const auto [low, high] =
      std::minmax_element(from + static_cast<std::ptrdiff_t>(first), from + static_cast<std::ptrdiff_t>(end));
  if (run.cart_locked || *low == *high) return true;
  return run.has_cart() && slides_on(run, accelerates_mps2_per_v, *high - *low, first, end) &&
         std::abs(shift_by_mean_m(run, accelerates_mps2_per_v, first, end)) <=
             largest_shift * run.cart_noise_m();
}

/// The samples of a run that are kept.
std::vector<std::size_t> kept_samples(const Measurement& run, double period_s,
                                      const std::vector<std::size_t>& gaps) {
  constexpr double slack_periods = 0.1;  // time stamps scatter
  const double longest_s = period_s + slack_periods * run.median_period_s();
  std::vector<std::size_t> kept = {0};
  for (std::size_t k = 1; k < run.size(); ++k) {
    const bool next_too_late = k + 1 == run.size() || run.time_s[k + 1] - run.time_s[kept.back()] > longest_s;
    const bool at_gap = std::binary_search(gaps.begin(), gaps.end(), k) ||
                        std::binary_search(gaps.begin(), gaps.end(), k + 1);
    if (next_too_late || at_gap) kept.push_back(k);
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

double impulse_vs(const Measurement& run, std::size_t first, std::size_t end) {
  double sum = 0.0;
  for (std::size_t k = first; k < end; ++k) sum += run.voltage_v[k] * (run.time_s[k + 1] - run.time_s[k]);
  return sum;
}

double mean_voltage(const Measurement& run, std::size_t first, std::size_t end) {
  const auto from = run.voltage_v.begin();
  const bool constant =
      std::all_of(from + static_cast<std::ptrdiff_t>(first), from + static_cast<std::ptrdiff_t>(end),
                  [&](double v) { return v == run.voltage_v[first]; });
  if (constant || end == run.size()) return run.voltage_v[first];
  return impulse_vs(run, first, end) / (run.time_s[end] - run.time_s[first]);
}

/// Fills the commands of a coarse run, and the mean from each sample to the next.
void set_voltages(const Measurement& run, const Plant& plant, const Thinning& thinning,
                  const std::vector<std::size_t>& kept, Measurement& coarse) {
  const double accelerates_mps2_per_v = std::abs(plant.motor.force_per_volt_n) / plant.cart_mass_kg;
  coarse.voltage_v.clear();
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const std::size_t first = kept[i], next = i + 1 < kept.size() ? kept[i + 1] : run.size();
    coarse.voltage_v.push_back(mean_voltage(run, first, next));
    coarse.first_command.push_back(coarse.commands.size());
    for (std::size_t k = first, end; k < next; k = end) {
      end = k + 1;
      while (end < next && may_replace(run, accelerates_mps2_per_v, thinning.largest_shift, k, end + 1))
        ++end;
      coarse.commands.push_back({run.time_s[k], mean_voltage(run, k, end)});
    }
  }
}

Measurement coarse_run(const Measurement& run, const Plant& plant, const Thinning& thinning) {
  const std::vector<std::size_t> gaps = gaps_in(run);
  const std::vector<std::size_t> kept = kept_samples(run, thinning.period_s, gaps);
  Measurement coarse = run;
  coarse.time_s = at(run.time_s, kept);
  set_voltages(run, plant, thinning, kept, coarse);
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
                                     const Thinning& thinning) {
  std::vector<Measurement> coarse;
  coarse.reserve(runs.size());
  for (const Measurement& run : runs) coarse.push_back(coarse_run(run, plant, thinning));
  return coarse;
}

}  // namespace upright
