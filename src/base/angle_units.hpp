// Conversion between radians, degrees and turns.
#pragma once

#include <numbers>

namespace upright {

inline constexpr double degrees_per_radian = 180.0 / std::numbers::pi;
inline constexpr double radians_per_degree = std::numbers::pi / 180.0;
inline constexpr double full_turn_rad = 2.0 * std::numbers::pi;

}  // namespace upright
