// The curve of an effect `force_table` in an answer, for those who print or draw it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// A force on the cart over one quantity.
struct DescribedCurve {
  std::string over;             ///< the word of the plant file
  std::string unit;             ///< of the quantity
  std::vector<double> at;       ///< the quantity at each node, as the following
  std::vector<double> force_n;  ///< the value of the table [N; N per m/s over position_and_velocity]
  std::vector<double> low_n;    ///< lower end of its 95 percent interval
  std::vector<double> high_n;   ///< upper end
};

/// Empty for any other effect.
std::optional<DescribedCurve> described_curve(const FoundEffect& effect);

}  // namespace upright
