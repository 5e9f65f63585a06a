// The next safe run: of the experiment files in config/experiments/diagnosis, the one that best distinguishes
// the confusable effects.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "experiment/experiment_file.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// The files of config/experiments/diagnosis, embedded in the program, each with its path in the repository.
struct LibraryExperiment {
  std::string file;
  Experiment experiment;
};
std::vector<LibraryExperiment> experiment_library();

/// `chosen` is the plant that was found, `alternatives` are plants that fit equally well, each with the
/// effect that it has instead.
std::optional<NextExperiment> choose_experiment(
    const Plant& chosen, const std::vector<std::pair<std::size_t, Plant>>& alternatives,
    const std::vector<Measurement>& runs);

}  // namespace upright
