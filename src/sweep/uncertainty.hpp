// Maps over an uncertain plant: for each starting angle and delay, the share of drawn plants that fall and
// that oscillate. Every point of the map gets the same plants (common random numbers).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "design/uncertain_plant.hpp"
#include "sim/loop/loop_run.hpp"

namespace upright {

class YamlKeys;

/// The section `uncertainty` of a sweep file.
struct Uncertainty {
  double percent = 0.0;                   ///< of the parameters without an interval
  std::filesystem::path intervals_file;   ///< empty: none
  std::vector<NumberInterval> intervals;  ///< of that file
  std::uint32_t samples = 0;              ///< number of plants
  std::uint32_t seed = 0;                 ///< of the draws
  std::optional<UncertainPlant> plants;   ///< set by `take_plants`

  /// As it stands in sweep.yaml, with the intervals in place of their file.
  std::string text() const;
};

/// Visits the keys of the section. `plant`: the plant of the sweep, when reading; then the plants are made,
/// and refused where one cannot be simulated.
void uncertainty_keys(YamlKeys& keys, Uncertainty& uncertainty, const Plant& plant);

/// How many of the plants did what, from one start under one delay.
struct PlantCounts {
  std::uint32_t falls = 0, oscillates = 0;
};

/// A share of samples with its 95 percent interval (Wilson 1927).
struct Share {
  double value = 0.0, low = 0.0, high = 1.0;
};
Share share_of(std::uint32_t count, std::uint32_t samples);

/// One point of the map.
struct UncertainPoint {
  LoopCase start;
  PlantCounts counts;
};

/// uncertainty.csv.
std::string uncertainty_csv(const std::vector<UncertainPoint>& points, std::uint32_t samples);
inline constexpr const char* uncertainty_header =
    "theta0_rad,delay_s,samples,share_falls,low,high,share_oscillates,oscillates_low,oscillates_high";

/// A delay counts as tolerated while fewer plants than this share fall.
inline constexpr double tolerated_share = 0.05;

/// The largest delay up to which, from one starting angle, fewer than `tolerated_share` of the plants fall at
/// every delay of the sweep; NaN: not even at the first.
struct ToleratedDelay {
  double theta0_rad = 0.0, delay_s = 0.0;
  Share falls;  ///< at this delay
};
/// `points` by angle, then delay.
std::vector<ToleratedDelay> tolerated_delays(const std::vector<UncertainPoint>& points,
                                             std::uint32_t samples);

}  // namespace upright
