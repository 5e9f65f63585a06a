#include "attached_mass_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace upright {

namespace {

struct Frequencies {
  double slowest_hz, fastest_hz;
};

Frequencies frequencies_shown(const DataRange& range, const PriorPolicy& prior) {
  // In segments that are shorter than a period, the initial states of the mass account for any slow force.
  return {std::max(prior.crests_of_pitch / range.longest_run_s, 1.0 / range.longest_segment_s),
          1.0 / (prior.samples_of_vibration * range.shortest_period_s)};
}

/// Up to two and a half octaves below and above the typical frequency.
std::vector<double> frequencies_to_try(double typical_hz, double octaves_apart, const Frequencies& shown) {
  constexpr double most_octaves = 2.5;
  const int steps = static_cast<int>(most_octaves / octaves_apart);
  std::vector<double> frequencies;
  for (int i = -steps; i <= steps; ++i) {
    const double hz = typical_hz * std::exp2(octaves_apart * i);
    if (hz > shown.slowest_hz && hz < shown.fastest_hz) frequencies.push_back(hz);
  }
  return frequencies;
}

/// Of a spring on which this mass vibrates [N/m].
double stiffness_for(double mass_kg, double frequency_hz) {
  const double radps = 2.0 * std::numbers::pi * frequency_hz;
  return mass_kg * radps * radps;
}

}  // namespace

void limit_attached_mass(std::size_t effect, const DataRange& range, const PriorPolicy& prior,
                         std::vector<FreeParameter>& free) {
  const auto [slowest_hz, fastest_hz] = frequencies_shown(range, prior);
  const auto parameters = effect_registry()[effect].parameters;
  for (std::size_t i = 0; i < free.size(); ++i) {
    FreeParameter& p = free[i];
    const std::string_view name = parameters[i].name;
    if (name == "sprung_mass_kg") p.high = range.cart_mass_kg;
    if (name == "damping_ratio") p.high = 1.0;  // beyond it, nothing vibrates
    if (name == "gap_m") p.high = range.longest_travel_m;
    if (name == "frequency_hz") {
      p.low = slowest_hz;
      p.high = fastest_hz;
    }
    if (name == "stiffness_n_per_m" && range.longest_travel_m > 0.0) {
      p.low = range.largest_force_n / range.longest_travel_m;
      p.high = stiffness_for(range.cart_mass_kg, fastest_hz);
    }
  }
}

std::vector<std::vector<double>> attached_mass_starts(std::size_t effect, const DataRange& range,
                                                      const PriorPolicy& prior) {
  const Frequencies shown = frequencies_shown(range, prior);
  const auto parameters = effect_registry()[effect].parameters;
  std::vector<std::vector<double>> starts;
  if (effect == effect_index<effects::SprungMass>()) {
    constexpr double cart_share = 0.03, damping_ratio = 0.2;  // the peak is broad: a start may be far off
    for (const double frequency_hz : frequencies_to_try(parameters[1].typical, 1.0, shown))
      starts.push_back({cart_share * range.cart_mass_kg, frequency_hz, damping_ratio});
    return starts;
  }
  if (effect == effect_index<effects::FlexibleRod>()) {
    constexpr double share = 0.3, damping_ratio = 0.05;  // rods ring for long: a start must be near
    for (const double frequency_hz : frequencies_to_try(parameters[1].typical, 0.5, shown))
      starts.push_back({share, frequency_hz, damping_ratio});
    return starts;
  }
  constexpr double contact_hz = 100.0;
  const double share = parameters[1].typical;
  const double stiffness =
      stiffness_for(share * range.cart_mass_kg, std::min(contact_hz, 0.5 * shown.fastest_hz));
  for (const double times : {0.25, 1.0, 4.0})
    starts.push_back({times * parameters[0].typical, share, stiffness, parameters[3].typical});
  return starts;
}

}  // namespace upright
