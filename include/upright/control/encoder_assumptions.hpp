// Bounds on motor, cart and pendulum that the encoder watch assumes, and the encoders that it may find stuck.
// The bounds come from the rig file (section `encoder_watch`) or are derived from a plant file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "upright/model/plant.hpp"

namespace upright {

class YamlKeys;

/// Which encoder is stuck.
enum class StuckEncoder : std::uint8_t { none, cart, pendulum };

/// A lower and an upper bound of a quantity.
struct Bounds {
  double low = 0.0;   ///< lower end
  double high = 0.0;  ///< upper end
};

/// The defaults are the widest bounds that a file can state: from these, no encoder is found stuck.
struct EncoderAssumptions {
  /// Voltage at which the resting cart breaks away: dry friction and the amplifier's dead zone. Below
  /// `low` no cart moves, above `high` every cart moves.
  Bounds breakaway_v{0.0, 100.0};
  /// Time constant of a first-order lag that stands for delay and lag of the actuator: from 0 up to this.
  double largest_lag_s = 1.0;
  /// Lower bound of the cart's acceleration per volt above breakaway.
  double acceleration_mps2_per_v = 0.0;
  /// Upper bound of the voltage per velocity that back-EMF and viscous friction require.
  double damping_v_per_mps = 1e4;
  /// Distance by which motor, gear and friction can deflect while the cart does not slip [m].
  double unseen_travel_m = 0.1;
  /// Upper bound of the equivalent length: inertia about the pivot over m l (4/3 l for a rod).
  double longest_pendulum_m = 100.0;
  /// Upper bound of the friction in the pivot, as an acceleration of the cart.
  double pivot_friction_mps2 = 100.0;
};

/// The bounds that the section `encoder_watch` of a rig file states.
struct StatedAssumptions {
  std::optional<Bounds> breakaway_v;              ///< as in EncoderAssumptions, like the following
  std::optional<double> largest_lag_s;            ///< [s]
  std::optional<double> acceleration_mps2_per_v;  ///< [m/s^2/V]
  std::optional<double> damping_v_per_mps;        ///< [V s/m]
  std::optional<double> unseen_travel_m;          ///< [m]
  std::optional<double> longest_pendulum_m;       ///< [m]
  std::optional<double> pivot_friction_mps2;      ///< [m/s^2]
};

/// The bounds that a plant implies over the whole track and amplifier range: each number within a factor
/// 1 +- `uncertainty`. Without a pendulum its bounds keep their defaults.
EncoderAssumptions encoder_assumptions(const Plant& plant, double track_limit_m, double amplifier_limit_v,
                                       double uncertainty = 0.5);
/// The stated bounds for a rig without a plant. What is not stated is taken from an IP02 with up to 2 N of
/// dry friction, an actuator that is up to 30 ms late, and each of Quanser's pendulums.
EncoderAssumptions encoder_assumptions(const StatedAssumptions& stated, double track_limit_m);
/// The keys that only a plant could replace, and that are not stated.
std::vector<std::string> missing_assumptions(const StatedAssumptions& stated);

/// The union of these bounds and the stated ones.
EncoderAssumptions widened(EncoderAssumptions bounds, const StatedAssumptions& stated);

/// The keys of the section `encoder_watch` of a rig file.
void encoder_assumption_keys(YamlKeys& keys, StatedAssumptions& stated);
/// The same section as a map on one line.
std::string encoder_assumptions_text(const EncoderAssumptions& assumptions);

}  // namespace upright
