// Makes the rig over a hardware link that a rig file describes, and puts around it what every rig has. The
// simulated one is made by simulated_rig.hpp.
#pragma once

#include <memory>

#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// What a run adds to the rig file.
struct RigOptions {
  double period_s = 0.0;  ///< of the loop: links must answer within it
};

/// Throws ConfigError where the rig's link cannot carry a loop of this period: its response timeout or the
/// bytes of one period on a serial line take longer.
void require_link_fits(const RigFile& rig, double period_s);

/// The rig as every command uses it: the counts of `parts` are checked, and the digital lines of `rig` stop
/// it.
std::unique_ptr<Rig> assembled(std::unique_ptr<Rig> parts, const RigFile& rig);

/// Throws ConfigError for what this build or this combination cannot do, and for a response timeout that does
/// not fit into the period. The rig is not open yet.
std::unique_ptr<Rig> make_rig(const RigFile& rig, const RigOptions& options);

}  // namespace upright
