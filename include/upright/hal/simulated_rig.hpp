// The rig in simulation: the plant behind encoders and an amplifier, in real or in virtual time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

struct SimulatedRigOptions {
  std::uint64_t seed = 1;            ///< of sensor noise and timing jitter
  std::optional<double> theta0_rad;  ///< in place of the rig file's initial angle
};

/// Reads the plant file that `rig` names. The plant is held in its initial state, as a hand would, until the
/// first write; from then on it is integrated exactly between the times at which voltages were written.
/// Counts are those of `rig`'s calibration. In virtual time the same seed gives the same counts, bit for bit.
/// Throws ConfigError.
std::unique_ptr<Rig> make_simulated_rig(const RigFile& rig, Clock& clock, const SimulatedRigOptions& options);

}  // namespace upright
