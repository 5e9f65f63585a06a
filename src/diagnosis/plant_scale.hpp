// The limits of a diagnosis for a plant of another size. What selection_policy.hpp states as a speed, a
// voltage, a force or a length holds for a small cart (about 1 kg, with a pendulum of about 0.4 m).
#pragma once

#include "selection_policy.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// The size of a plant relative to the small cart. Powers of ten: these limits need an order of magnitude
/// only, and two plants of similar size have the same ones.
struct PlantScale {
  double length = 1.0, speed = 1.0, rate = 1.0, voltage = 1.0, force = 1.0, torque = 1.0;
};

/// Gravity sets the pace of a pendulum, and damping that of a cart alone. The motor's force per volt follows
/// from the weight that it accelerates.
PlantScale scale_of(const Plant& plant);

/// The default limits, for this plant.
SelectionPolicy policy_for(const Plant& plant);

}  // namespace upright
