// Records that are too long to be searched as a whole.
#pragma once

#include <cstddef>
#include <vector>

#include "upright/measurement/measurement.hpp"

namespace upright {

/// What a diagnosis is given at most. A search holds about 1 kB and follows each sample some thousands of
/// times: this is a tenth of a gigabyte, and minutes.
inline constexpr std::size_t most_diagnosed_samples = 100'000;

/// What an identification is given at most: it fits a part of its own choice, but looks at all of it for
/// breakaways and steady speeds, which takes about 300 bytes a sample.
inline constexpr std::size_t most_identified_samples = 500'000;

/// The runs with about `most` samples in all. Of long runs pieces of some seconds are kept, evenly spread and
/// parted by breaks; of many short ones every n-th. A note in the first run says what was left out.
std::vector<Measurement> within_samples(std::vector<Measurement> runs, std::size_t most);

}  // namespace upright
