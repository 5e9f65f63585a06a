// Experiment folders as data: the runs in them that are whole.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace upright::cli {

struct NamedRuns {
  std::vector<std::filesystem::path> runs;  ///< in the order named; of an experiment, of its trials
  std::vector<std::string> left_out;        ///< which, and why, a sentence each
};

/// What `--data` names, with experiment folders (those with a trials.csv) replaced by their runs. Pieces that
/// were interrupted or never began are left out. Throws ConfigError where a folder has no other ones.
NamedRuns runs_named(const std::vector<std::string>& data);

}  // namespace upright::cli
