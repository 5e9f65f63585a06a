// Records that are too long to be analysed completely.
#pragma once

#include <cstddef>
#include <vector>

#include "upright/measurement/measurement.hpp"

namespace upright {

/// The most samples for a diagnosis. A search needs about 1 kB for each sample and follows it some thousand
/// times, so this needs a tenth of a gigabyte and some minutes.
inline constexpr std::size_t max_diagnosed_samples = 100'000;

/// The most samples for an identification. It fits only a part, but searches all samples for breakaways and
/// steady speeds, which needs about 300 bytes for each sample.
inline constexpr std::size_t max_identified_samples = 500'000;

/// The runs reduced to about `max_samples` samples. Long runs keep pieces of some seconds, evenly spread and
/// separated by breaks; of many short runs, every n-th is kept. A note in the first run says what was left
/// out.
std::vector<Measurement> within_samples(std::vector<Measurement> runs, std::size_t max_samples);

}  // namespace upright
