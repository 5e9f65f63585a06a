// An estimated parameter of an effect.
#pragma once

#include <string>

namespace upright {

struct ParameterEstimate {
  std::string name;
  std::string unit;
  double value = 0.0;
  double low = 0.0, high = 0.0;  ///< 95 percent confidence interval
};

}  // namespace upright
