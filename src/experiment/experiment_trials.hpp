// The record of an experiment's trials, inside the runtime.
#pragma once

#include "experiment.hpp"

namespace upright {

/// What experiment.yaml holds: tells one experiment from another.
std::string experiment_record(const ExperimentSetup& setup, const std::vector<Piece>& pieces);

/// A file name as a cell of trials.csv: what a CSV file would misread becomes an underscore.
std::string csv_name(const std::filesystem::path& file);

/// Replaces trials.csv as a whole, so that it is never half written.
void write_trials(const std::filesystem::path& folder, const std::vector<Piece>& pieces,
                  const std::vector<TrialResult>& results);

/// For each delay sweep among the pieces, `sweep.csv` and `transitions.csv` as a simulated sweep has them: a
/// row per run, and a row per repeat. With several sweeps their labels come first in the names.
void write_sweep_tables(const std::filesystem::path& folder, const std::vector<Piece>& pieces,
                        const std::vector<TrialResult>& results);

}  // namespace upright
