// Scales among what was found that no plant has, or that no data sheet is off by.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "search.hpp"

namespace upright {

/// A scale at the end of what it may be stands for something else: the sentence on it.
std::optional<std::string> sentence_on_impossible_scale(const Hypothesis& known,
                                                        const std::vector<std::size_t>& effects);

/// On numbers of the plant file that are off by more than a data sheet is.
std::vector<std::string> notes_on_doubtful_numbers(const Hypothesis& known,
                                                   const std::vector<std::size_t>& effects,
                                                   const PriorPolicy& policy);

}  // namespace upright
