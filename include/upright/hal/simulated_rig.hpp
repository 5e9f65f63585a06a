// The simulated rig: a plant with encoders and an amplifier, in real or in virtual time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// What a run adds to the rig file.
struct SimulatedRigOptions {
  std::uint64_t seed = 1;            ///< of sensor noise and timing jitter
  std::optional<double> theta0_rad;  ///< replaces the rig file's initial angle
};

/// Actions of an operator on a rig between runs.
struct Hand {
  Pose pose;               ///< moves cart and pendulum here, at rest
  double push_mps = 0.0;   ///< releases the cart with this velocity
  bool cart_held = false;  ///< holds the cart from now on
  /// Holds everything until the first nonzero voltage, for this long at most.
  double holds_s = 0.0;
  bool amplifier_off = false;  ///< disables the amplifier: neither voltage nor offset reaches the motor
  bool turned = false;         ///< the rig is turned by 180 degrees: effects of the room change their sign
};

/// The plant after an action of the operator.
Plant handled(Plant plant, const Hand& hand);

/// The simulated rig with an operator.
class SimulatedRigWithHand : public Rig {
 public:
  /// Outside the loop, on an open rig. Cancels the previous action.
  virtual void handle(const Hand& hand) = 0;
  /// Integration steps since the last action of the operator. An event counts as the steps of its root
  /// search. A measure of computing time, which is much larger for a stiff plant.
  virtual std::uint64_t steps_taken() const noexcept = 0;
};

/// Reads the plant file that `rig` names. The plant is held in its initial state until the first
/// write; from then on it is integrated exactly between the times of the writes. Counts follow the
/// calibration of `rig`. In virtual time equal seeds give bit-identical counts. Throws
/// ConfigError.
std::unique_ptr<SimulatedRigWithHand> make_simulated_rig(const RigFile& rig, Clock& clock,
                                                         const SimulatedRigOptions& options);
/// The same with a plant in place of the one that `rig` names.
std::unique_ptr<SimulatedRigWithHand> make_simulated_rig(const RigFile& rig, const Plant& plant, Clock& clock,
                                                         const SimulatedRigOptions& options);

}  // namespace upright
