// A rig made of several: the cart's counts from one, the pendulum's from another, the voltage to a third.
#pragma once

#include <memory>
#include <vector>

#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// A rig, and what of it is used.
struct RigPart {
  std::unique_ptr<Rig> rig;
  RigRoles roles;
};

/// `parts` have each role once between them. Every part is read in every period, that of the output first, so
/// that the counts are as new as can be when the voltage follows; a part without an encoder is asked for its
/// health only.
///
/// A reading is worth what its worst part is worth. It carries the time of the older of its counts; counts
/// taken further apart than half a `period_s` do not belong together and are stale. A part that calls counts
/// fresh without a new sequence number is stale too.
///
/// `open` begins with the output and stops every part when one does not open. `stop` stops them all, the
/// output first.
std::unique_ptr<Rig> joined(std::vector<RigPart> parts, double period_s);

}  // namespace upright
