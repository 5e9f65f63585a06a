// The next safe run: of a library of experiments, the one that best tells the explanations apart that the
// data leave open.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "upright/analysis/diagnosis.hpp"

namespace upright {

/// `chosen` is the plant that was found, `rivals` those that explain the data as well, each with the effect
/// it has instead.
std::optional<NextExperiment> choose_experiment(const Plant& chosen,
                                                const std::vector<std::pair<std::size_t, Plant>>& rivals,
                                                const std::vector<Measurement>& runs);

}  // namespace upright
