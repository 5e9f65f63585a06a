// Whether a disturbance that varies slowly accounts for the data as well as an effect that was found.
//
// The search takes noise for white. A disturbance that lasts counts many times as evidence then, and an
// effect that resembles it is found. So each effect is tested once more beside a Gauss-Markov force and
// torque, whose size and correlation time are estimated with and without the effect. Values stay those of the
// white fit.
#pragma once

#include <optional>
#include <vector>

#include "reproducibility.hpp"

namespace upright {

/// Of these effects, the one that such a disturbance leaves the least evidence, if that is less than an
/// effect needs. `known`: a fit to all data. Corrections of the plant file's numbers and effects with
/// overwhelming evidence are not tested.
std::optional<std::size_t> outdone_by_coloured_noise(const Search& search, const Hypothesis& known,
                                                     const std::vector<Reproduction>& effects);

}  // namespace upright
