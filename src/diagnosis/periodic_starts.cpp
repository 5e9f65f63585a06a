#include "periodic_starts.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "base/median.hpp"
#include "candidates.hpp"
#include "estimation/periodogram.hpp"

namespace upright {

namespace {

bool is_of_encoder(std::size_t effect) {
  return effect == effect_index<effects::EncoderEccentricity>();
}

/// The force of an effect of size one at its crest, to first order; of an encoder at a pitch of 2 pi.
double force_of_unit_size(std::size_t effect, const PlaceForce& at) {
  if (is_of_encoder(effect)) return -at.speed_squared_nm;
  return effect == effect_index<effects::TorqueRipple>() ? at.ripple_n : 1.0;
}

/// Parameters of an effect whose force is this sine.
std::vector<double> start_at(const FittedSine& sine, std::size_t effect) {
  const double waves_per_m = is_of_encoder(effect) ? 2.0 * std::numbers::pi * sine.frequency_per_m : 1.0;
  const double largest = effect_registry()[effect].parameters[0].range.high;
  return {std::min(sine.size / waves_per_m, largest), 1.0 / sine.frequency_per_m, sine.phase_rad};
}

/// What sines explain by chance about a frequency: a median, over a range of which a peak is a small part.
/// `sines`: of rising frequency, `place`: of one of them.
double usually_explained(const std::vector<FittedSine>& sines, std::size_t place) {
  constexpr double reach = 3.0;             // of the range, times the frequency
  constexpr std::size_t on_each_side = 16;  // at least, for a median
  const auto place_of = [&](double frequency_per_m) {
    return static_cast<std::size_t>(
        std::ranges::lower_bound(sines, frequency_per_m, {}, &FittedSine::frequency_per_m) - sines.begin());
  };
  const double middle_per_m = sines[place].frequency_per_m;
  const std::size_t first = std::min(place_of(middle_per_m / reach), place - std::min(place, on_each_side));
  const std::size_t end =
      std::max(place_of(middle_per_m * reach), std::min(place + on_each_side, sines.size()));
  std::vector<double> explained;
  for (std::size_t i = first; i < end; ++i) explained.push_back(sines[i].explained);
  return std::max(median_of(std::move(explained)), std::numeric_limits<double>::min());
}

/// First what explains most, compared with others of about its frequency: the residual force is not white,
/// for the noise of a position grows as a force with the square of its frequency. In the result, `explained`
/// is a multiple of what is usual [1].
std::vector<FittedSine> ranked(const std::vector<FittedSine>& sines) {
  constexpr double band = 1.2;  // of frequencies with the same comparison, which takes time
  std::vector<FittedSine> compared = sines;
  double usual_n2 = 1.0, to_per_m = 0.0;
  for (std::size_t i = 0; i < sines.size(); ++i) {
    if (sines[i].frequency_per_m >= to_per_m) {
      usual_n2 = usually_explained(sines, i);
      to_per_m = band * sines[i].frequency_per_m;
    }
    compared[i].explained /= usual_n2;
  }
  std::ranges::sort(compared, std::greater{}, &FittedSine::explained);
  return compared;
}

/// Whether none of these starts has the pitch of a sine, and few enough are within a factor of two of it.
bool differs_enough(const FittedSine& sine, const std::vector<std::vector<double>>& starts,
                    double spacing_per_m, const SearchBudget& budget) {
  std::size_t alike = 0;
  for (const std::vector<double>& start : starts) {
    const double frequency_per_m = 1.0 / start[1], ratio = sine.frequency_per_m / frequency_per_m;
    if (std::abs(frequency_per_m - sine.frequency_per_m) < 4.0 * spacing_per_m) return false;
    if (ratio < 2.0 && ratio > 0.5) ++alike;
  }
  return alike < budget.max_alike_pitches;
}

}  // namespace

/// An effect counts as one that repeats when a run passes some of its crests. Several runs at different
/// places pass the same crests together, but each could as well have a force of its own.
double longest_pitch_m(const DataRange& range, const PriorPolicy& prior) {
  return std::max(prior.min_longest_pitch_m, range.longest_travel_m / prior.crests_of_pitch);
}

std::vector<std::vector<double>> periodic_starts(std::size_t effect, const std::vector<PlaceForce>& residual,
                                                 const DataRange& range, const PriorPolicy& prior,
                                                 const SearchBudget& budget) {
  const std::vector<std::vector<double>> any = {{effect_registry()[effect].parameters[0].typical, 0.02, 0.0}};
  const double travel = range.cart_high_m - range.cart_low_m;
  if (residual.size() < budget.min_residual_samples || travel <= 0.0) return any;
  std::vector<PeriodogramSample> samples;
  samples.reserve(residual.size());
  for (const PlaceForce& at : residual)
    samples.push_back({at.cart_m, at.force_n, force_of_unit_size(effect, at)});
  const double longest = longest_pitch_m(range, prior);
  // Frequencies over the track one half-cycle apart, so that no crest is missed.
  const double spacing = 0.25 / travel;
  const double shortest = std::max(0.001, 1.0 / (1.0 / longest + budget.max_frequencies * spacing));
  const std::vector<FittedSine> found = periodogram(samples, 1.0 / longest, 1.0 / shortest, spacing);
  std::vector<std::vector<double>> starts;
  for (const FittedSine& sine : ranked(found)) {
    if (differs_enough(sine, starts, spacing, budget)) starts.push_back(start_at(sine, effect));
    if (starts.size() == budget.max_pitches) break;
  }
  return starts.empty() ? any : starts;
}

}  // namespace upright
