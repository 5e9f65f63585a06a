// How many runs the vector engine takes at once.
#pragma once

#include <cstddef>

namespace upright {

constexpr std::size_t lane_count = 16;

}  // namespace upright
