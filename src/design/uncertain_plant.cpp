#include "uncertain_plant.hpp"

#include <algorithm>
#include <random>

#include "upright/base/error.hpp"

namespace upright {

namespace {

/// The name of a parameter in the intervals of plant files.
std::string interval_name(const UncertainParameter& parameter) {
  std::string name = parameter.name;
  std::replace(name.begin(), name.end(), ' ', '.');
  return name;
}

/// From 0 to below 1. The standard library's distributions differ between implementations.
double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11u) * 0x1p-53;
}

/// No pendulum has less inertia than a point of its mass in its centre.
void keep_inertia_possible(Pendulum& pendulum) {
  const double point = pendulum.mass_kg * pendulum.length_to_com_m * pendulum.length_to_com_m;
  if (pendulum.inertia_about_pivot_kgm2() < point) pendulum.given_inertia_kgm2 = point;
}

[[noreturn]] void refuse_unknown(const NumberInterval& interval, const std::vector<std::string>& names) {
  const std::string nearest = nearest_name(interval.number, names);
  throw ConfigError("has an interval of " + interval.number + ", which is no number of the plant: " +
                    (nearest.empty() ? "remove it, or name the plant file that it belongs to"
                                     : "did you mean " + nearest + "?"));
}

void refuse_outside(const NumberInterval& interval, const Range& range) {
  if (range.contains(interval.low) && range.contains(interval.high)) return;
  throw ConfigError("has an interval of " + interval.number + " from " + exact_text(interval.low) + " to " +
                    exact_text(interval.high) + ", which leaves its range: keep it " + range.text());
}

}  // namespace

UncertainPlant::UncertainPlant(const Plant& plant, double share, const std::vector<NumberInterval>& intervals)
    : plant_(plant) {
  std::vector<std::string> names;
  for (const UncertainParameter& parameter : uncertain_parameters(plant)) {
    const auto [low, high] = std::minmax({parameter.value * (1.0 - share), parameter.value * (1.0 + share)});
    drawn_.push_back({parameter, std::max(low, parameter.range.low), std::min(high, parameter.range.high)});
    names.push_back(interval_name(parameter));
  }
  for (const NumberInterval& interval : intervals) {
    const auto at = std::find(names.begin(), names.end(), interval.number);
    if (at == names.end()) refuse_unknown(interval, names);
    Drawn& drawn = drawn_[static_cast<std::size_t>(at - names.begin())];
    refuse_outside(interval, drawn.parameter.range);
    drawn.low = interval.low;
    drawn.high = interval.high;
  }
}

Plant UncertainPlant::draw(std::uint32_t seed, std::uint32_t sample) const {
  std::seed_seq both{seed, sample};
  std::mt19937_64 random(both);
  Plant plant = plant_;
  for (const Drawn& drawn : drawn_) {
    const double part = uniform(random);  // drawn even where unused: the others stay the same
    if (drawn.low != drawn.high || drawn.low != drawn.parameter.value)
      drawn.parameter.set(plant, drawn.low + (drawn.high - drawn.low) * part);
  }
  if (plant.pendulum) keep_inertia_possible(*plant.pendulum);
  return plant;
}

}  // namespace upright
