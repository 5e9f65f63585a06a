// Makes the rig that a rig file describes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// What a run adds to the rig file.
struct RigOptions {
  double period_s = 0.0;             ///< of the loop: links must answer within it
  bool virtual_time = false;         ///< simulated rig only: time passes as the loop says (`--fast`)
  std::uint64_t seed = 1;            ///< simulated rig only: noise and jitter
  std::optional<double> theta0_rad;  ///< simulated rig only: in place of the file's initial angle
};

/// Throws ConfigError for what this build or this combination cannot do, and for a response timeout that does
/// not fit into the period. The rig is not open yet.
std::unique_ptr<Rig> make_rig(const RigFile& rig, const RigOptions& options);

}  // namespace upright
