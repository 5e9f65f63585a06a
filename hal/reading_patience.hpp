// How long a backend waits for a reading.
#pragma once

namespace upright {

/// The rest of a period is for computing and writing. Chosen.
inline constexpr double reading_share_of_period = 0.75;

}  // namespace upright
