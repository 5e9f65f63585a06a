// A fit without one of its effects, to see what the effect is worth.
#pragma once

#include <cstddef>
#include <vector>

#include "estimation/fit.hpp"

namespace upright {

/// The point with another plant and the same motion.
FitPoint moved_to(FitPoint point, const Plant& plant);

/// The plant without an effect: with what `given`, the plant file, says of it instead.
Plant without_effect(Plant plant, std::size_t effect, const Plant& given);

/// Whether the others can be without it: the plant is possible then.
bool is_removable(const Plant& plant, std::size_t effect, const Plant& given);

/// Fits the data from this point without an effect. `free`: the parameters of the fit with it.
FitResult fit_without(const FitData& data, const FitPoint& with, std::size_t effect,
                      std::vector<FreeParameter> free, const Plant& given, const FitOptions& options);

}  // namespace upright
