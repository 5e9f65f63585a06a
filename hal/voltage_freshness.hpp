// When a voltage has become old on its way to the motor: the loop and a link's thread each ask before they
// send it.
#pragma once

namespace upright {

/// A voltage is old so many periods after the cycle it was meant for was due. A cycle may begin up to a
/// period late before it counts as missed.
inline constexpr int freshness_periods = 2;

}  // namespace upright
