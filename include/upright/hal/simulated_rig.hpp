// The rig in simulation: the plant behind encoders and an amplifier, in real or in virtual time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

struct SimulatedRigOptions {
  std::uint64_t seed = 1;            ///< of sensor noise and timing jitter
  std::optional<double> theta0_rad;  ///< in place of the rig file's initial angle
};

/// What an operator does to a rig between runs.
struct Hand {
  Pose pose;               ///< brings cart and pendulum here, at rest
  double push_mps = 0.0;   ///< lets go of the cart with this velocity
  bool cart_held = false;  ///< holds the cart from now on
  /// Holds everything until the first voltage that is not zero, or for this long.
  double holds_s = 0.0;
  bool amplifier_off = false;  ///< switches it off: no voltage and no offset reaches the motor
  bool turned = false;  ///< the rig stands the other way round: what comes from the room changes its sign
};

/// The plant as the operator left it.
Plant handled(Plant plant, const Hand& hand);

/// The simulated rig, with somebody beside it.
class SimulatedRigWithHand : public Rig {
 public:
  /// Outside the loop, on an open rig. Undoes what the hand did before.
  virtual void handle(const Hand& hand) = 0;
  /// Steps that the plant's integration has taken since the hand last did something, an event counted as the
  /// steps that finding its time takes: a measure of the computing, of which a stiff plant needs much more.
  virtual std::uint64_t steps_taken() const noexcept = 0;
};

/// Reads the plant file that `rig` names. The plant is held in its initial state, as a hand would, until the
/// first write; from then on it is integrated exactly between the times at which voltages were written.
/// Counts are those of `rig`'s calibration. In virtual time the same seed gives the same counts, bit for bit.
/// Throws ConfigError.
std::unique_ptr<SimulatedRigWithHand> make_simulated_rig(const RigFile& rig, Clock& clock,
                                                         const SimulatedRigOptions& options);
/// The same with a plant in the place of the one that `rig` names.
std::unique_ptr<SimulatedRigWithHand> make_simulated_rig(const RigFile& rig, const Plant& plant, Clock& clock,
                                                         const SimulatedRigOptions& options);

}  // namespace upright
