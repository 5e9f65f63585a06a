// What the watch on the encoders takes for granted about motor, cart and pendulum: bounds, not values. They
// stand in the rig file (section `encoder_watch`) or follow from a plant file.
#pragma once

#include <string>

#include "upright/model/plant.hpp"

namespace upright {

class YamlKeys;

/// A quantity that lies between two values.
struct Bounds {
  double low = 0.0, high = 0.0;
};

/// The defaults cover an IP02 with dry friction up to 2 N, an actuator that is up to 30 ms late, and each of
/// Quanser's pendulums.
struct EncoderAssumptions {
  /// Voltage at which the resting cart breaks away: its dry friction and the amplifier's dead zone. Below
  /// `low` every cart rests, above `high` every cart moves.
  Bounds breakaway_v{0.1, 1.4};
  /// First-order lag that stands for delay and lag between a command and its force, at most; 0 at least.
  double largest_lag_s = 0.03;
  /// Acceleration of the cart by a volt beyond breakaway, at least.
  double acceleration_mps2_per_v = 1.1;
  /// Volts that keep up a velocity against back-EMF and viscous friction, at most.
  double damping_v_per_mps = 8.0;
  /// Distance over which motor, gear and friction may yield without a slip of the cart.
  double unseen_travel_m = 5e-5;
  /// Inertia about the pivot over mass times distance to the centre of mass (4/3 l for a rod), at most.
  double longest_pendulum_m = 0.7;
  /// Acceleration of the cart that friction in the pivot can take from the pendulum, at most.
  double pivot_friction_mps2 = 0.1;
};

/// What a plant implies, each number within a factor 1 +- `uncertainty`, over the whole track and amplifier
/// range. A plant without pendulum leaves the pendulum's numbers at their defaults.
EncoderAssumptions encoder_assumptions(const Plant& plant, double track_limit_m, double amplifier_limit_v,
                                       double uncertainty = 0.5);

/// Bounds that hold where either of two sets of bounds does.
EncoderAssumptions either(const EncoderAssumptions& a, const EncoderAssumptions& b);

/// The keys of the section `encoder_watch` of a rig file; one that is left out keeps its value.
void encoder_assumption_keys(YamlKeys& keys, EncoderAssumptions& assumptions);
/// The same section as a map on one line.
std::string encoder_assumptions_text(EncoderAssumptions assumptions);

}  // namespace upright
