// The map of a sweep over an uncertain plant: the share of plants that fall, over delay and starting angle.
#pragma once

#include <filesystem>
#include <vector>

#include "html.hpp"
#include "plot.hpp"

namespace upright {

/// Where along the delays the share of plants that fall first reaches `share`, by linear interpolation: one
/// delay for each starting angle, NaN where it does not reach it or already has at the first delay.
struct FallContour {
  double share = 0.0;
  std::vector<double> delay_s;
};

/// The contents of uncertainty.csv.
struct UncertaintyMap {
  std::vector<double> angles_deg, delays_s;
  std::vector<double> share_falls;  ///< angle by angle
  double samples = 0.0;             ///< number of plants
  std::vector<double> tolerated_s;  ///< by angle: fewer than 5 percent fall up to here; NaN: nowhere
};

/// Throws ConfigError when the file is not a whole map.
UncertaintyMap read_uncertainty_map(const std::filesystem::path& file);

/// The delays at which 10, 50 and 90 percent fall.
std::vector<FallContour> fall_contours(const UncertaintyMap& map);

Plot uncertainty_plot(const UncertaintyMap& map);
HtmlTable uncertainty_table(const UncertaintyMap& map);

}  // namespace upright
