// An estimated parameter of an effect.
#pragma once

#include <string>

namespace upright {

/// A parameter with its uncertainty.
struct ParameterEstimate {
  std::string name;    ///< as in plant files
  std::string unit;    ///< of the value
  double value = 0.0;  ///< the estimate
  double low = 0.0;    ///< lower end of the 95 percent confidence interval
  double high = 0.0;   ///< upper end
};

}  // namespace upright
