// The next safe run: of the experiment files in config/experiments/diagnosis, the one that best tells the
// explanations apart that the data leave open.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "experiment/experiment_file.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// The library: the files of config/experiments/diagnosis, carried by the program, each with its path in the
/// repository.
struct LibraryExperiment {
  std::string file;
  Experiment experiment;
};
std::vector<LibraryExperiment> experiment_library();

/// `chosen` is the plant that was found, `alternatives` those that explain the data as well, each with the
/// effect it has instead.
std::optional<NextExperiment> choose_experiment(
    const Plant& chosen, const std::vector<std::pair<std::size_t, Plant>>& alternatives,
    const std::vector<Measurement>& runs);

}  // namespace upright
