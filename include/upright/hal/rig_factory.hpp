// Makes the rig that a rig file describes for a hardware link, with the checks that all rigs share.
// simulated_rig.hpp makes the simulated rig.
#pragma once

#include <memory>

#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// What a run adds to the rig file.
struct RigOptions {
  double period_s = 0.0;  ///< period of the loop, within which links must answer
};

/// Throws ConfigError where the link cannot sustain a loop of this period: the response timeout, or the
/// bytes of one period on a serial line, take longer.
void require_link_fits(const RigFile& rig, double period_s);

/// The rig as every command uses it: the counts of `parts` are checked for plausibility, and the digital
/// lines of `rig` stop the motor.
std::unique_ptr<Rig> assembled(std::unique_ptr<Rig> parts, const RigFile& rig);

/// Makes a rig that is not yet open. Throws ConfigError for what this build or combination does not
/// support, and for a response timeout that does not fit into the period.
std::unique_ptr<Rig> make_rig(const RigFile& rig, const RigOptions& options);

}  // namespace upright
