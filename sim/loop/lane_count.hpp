// How many runs the vector engine takes at once.
#pragma once

#include <cstddef>

namespace upright {

// Two registers, so that one hides the latency of the other; more would not stay in registers.
#ifdef __AVX512F__
constexpr std::size_t lane_count = 16;
#else
constexpr std::size_t lane_count = 8;
#endif

}  // namespace upright
