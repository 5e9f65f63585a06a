// Numbers in JSON, which has no infinity and no NaN.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace upright::cli {

/// The value, or null if it is not finite.
inline nlohmann::ordered_json finite_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace upright::cli
