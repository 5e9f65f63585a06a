#include "uncertainty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/yaml_keys.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

constexpr std::int64_t max_samples = 10'000;
constexpr double max_percent = 50.0;  // beyond it a mass or a length may nearly vanish

/// Refuses `key` for the reason "CAUSE: REMEDY".
[[noreturn]] void refuse(const YamlMap& map, const char* key, const std::string& reason) {
  const std::size_t colon = reason.find(": ");
  map.fail(key, reason.substr(0, colon), reason.substr(colon + 2));
}

void take_plants(const YamlMap& map, Uncertainty& uncertainty, const Plant& plant) {
  if (!uncertainty.intervals_file.empty()) {
    uncertainty.intervals = read_plant_intervals(uncertainty.intervals_file);
    if (uncertainty.intervals.empty())
      map.fail("intervals", "names " + uncertainty.intervals_file.string() + ", which has no intervals",
               "name a model.yaml that `upright diagnose --out` wrote, or give percent alone");
  }
  try {
    uncertainty.plants.emplace(plant, uncertainty.percent / 100.0, uncertainty.intervals);
  } catch (const ConfigError& error) {
    refuse(map, "intervals", error.what());
  }
  for (std::uint32_t sample = 0; sample < uncertainty.samples; ++sample) {
    const std::string fault = fault_of(uncertainty.plants->draw(uncertainty.seed, sample));
    if (fault.empty()) continue;
    map.fail(uncertainty.intervals.empty() ? "percent" : "intervals",
             "leads to a plant that cannot be simulated (sample " + std::to_string(sample) + ": " +
                 fault.substr(0, fault.find(": ")) + ")",
             "make it smaller, or remove the effect from the plant file");
  }
}

}  // namespace

void uncertainty_keys(YamlKeys& keys, Uncertainty& uncertainty, const Plant& plant) {
  const bool has_percent = keys.given("percent", true);
  if (has_percent) keys.number("percent", uncertainty.percent, Range::within(0.0, max_percent));
  keys.optional_path("intervals", uncertainty.intervals_file);
  keys.needs_any("percent", {"percent", "intervals"}, has_percent || !uncertainty.intervals_file.empty(),
                 "is missing, and so is intervals",
                 "set percent, or let intervals name the model.yaml of a diagnosis");
  std::int64_t samples = uncertainty.samples, seed = uncertainty.seed;
  keys.integer("samples", samples, 1, max_samples);
  keys.integer("seed", seed, 0, std::numeric_limits<std::uint32_t>::max());
  uncertainty.samples = static_cast<std::uint32_t>(samples);
  uncertainty.seed = static_cast<std::uint32_t>(seed);
  const YamlMap* map = keys.source();
  if (map == nullptr) return;
  map->finish();
  take_plants(*map, uncertainty, plant);
}

std::string Uncertainty::text() const {
  std::string text = "  uncertainty: {percent: " + exact_text(percent) +
                     ", samples: " + std::to_string(samples) + ", seed: " + std::to_string(seed) + "}\n";
  for (const NumberInterval& interval : intervals)
    text += "  # " + interval.number + " from " + exact_text(interval.low) + " to " +
            exact_text(interval.high) + "\n";
  return text;
}

Share share_of(std::uint32_t count, std::uint32_t samples) {
  constexpr double z = 1.959963984540054;  // of a normal deviate, 97.5 percent are below
  const double n = samples, p = count / n, z2 = z * z;
  const double middle = (p + 0.5 * z2 / n) / (1.0 + z2 / n);
  const double half = z / (1.0 + z2 / n) * std::sqrt(p * (1.0 - p) / n + 0.25 * z2 / (n * n));
  return {p, count == 0 ? 0.0 : middle - half, count == samples ? 1.0 : middle + half};
}

std::string uncertainty_csv(const std::vector<UncertainPoint>& points, std::uint32_t samples) {
  std::string text = std::string(uncertainty_header) + "\n";
  for (const UncertainPoint& point : points) {
    text += exact_text(point.start.theta0_rad) + "," + exact_text(point.start.delay_s) + "," +
            std::to_string(samples);
    for (const std::uint32_t count : {point.counts.falls, point.counts.oscillates}) {
      const Share share = share_of(count, samples);
      for (const double value : {share.value, share.low, share.high}) text += "," + exact_text(value);
    }
    text += "\n";
  }
  return text;
}

std::vector<ToleratedDelay> tolerated_delays(const std::vector<UncertainPoint>& points,
                                             std::uint32_t samples) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<ToleratedDelay> delays;
  bool holds = false;
  for (const UncertainPoint& point : points) {
    if (delays.empty() || delays.back().theta0_rad != point.start.theta0_rad) {
      delays.push_back({point.start.theta0_rad, none, {none, none, none}});
      holds = true;
    }
    const Share falls = share_of(point.counts.falls, samples);
    holds = holds && falls.value < tolerated_share;
    if (holds) delays.back() = {point.start.theta0_rad, point.start.delay_s, falls};
  }
  return delays;
}

}  // namespace upright
