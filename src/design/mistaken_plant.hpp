// A plant none of whose numbers is right, for the question whether a controller that believes it still holds.
#pragma once

#include "upright/model/plant.hpp"

namespace upright {

/// Every number of `plant`, which has a pendulum, larger or smaller by `share` of itself, as a generator with
/// this seed says: the same on every machine. Gravity is right.
Plant mistaken_plant(Plant plant, unsigned seed, double share);

}  // namespace upright
