// A plant whose parameters are known within intervals only, and plants drawn from it.
#pragma once

#include <cstdint>
#include <vector>

#include "uncertain_parameters.hpp"
#include "upright/model/plant.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

/// Each parameter is uniform within its interval and independent of the others. Parameters without an
/// interval lie within the relative amount `share` of the plant's value. Gravity is exact, and so are the
/// words of effects.
class UncertainPlant {
 public:
  /// Throws ConfigError, as "CAUSE: REMEDY", when an interval is of no parameter of the plant or leaves the
  /// parameter's range.
  UncertainPlant(const Plant& plant, double share, const std::vector<NumberInterval>& intervals);

  /// Depends on the seed and the number of the sample only, and is equal on every machine.
  Plant draw(std::uint32_t seed, std::uint32_t sample) const;

 private:
  struct Drawn {
    UncertainParameter parameter;
    double low = 0.0, high = 0.0;
  };

  Plant plant_;
  std::vector<Drawn> drawn_;
};

}  // namespace upright
