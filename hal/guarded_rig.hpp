// A rig whose counts are checked before anybody uses them: a step that no motion explains is a fault of that
// reading; when the counts stay where they jumped to, they are lost for good.
#pragma once

#include <memory>

#include "upright/hal/calibration.hpp"
#include "upright/hal/rig.hpp"

namespace upright {

/// `calibration` is that of the rig's counts; its fastest motions are the limits.
/// A single such step is RigFault::corrupt_reply, the third in a row RigFault::counts_jumped, which stays
/// until the rig is opened again.
std::unique_ptr<Rig> guarded(std::unique_ptr<Rig> rig, const Calibration& calibration);

}  // namespace upright
