// The comparison of controllers that alternate in an experiment (A, B, A, B), by rounds. Slow changes of the
// rig (warm bearings, dust) affect both runs of a round equally, so they cancel in the difference.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "run_behaviour.hpp"

namespace upright {

/// One run of a comparison.
struct ComparedRun {
  std::string controller;
  int round = 0;
  RunBehaviour behaviour;
};

/// One quantity of a controller compared with the first one, over the rounds in which both stayed up.
struct PairedDifference {
  std::size_t quantity = 0;     ///< place in `quantities`
  double from = 0.0, to = 0.0;  ///< means
  /// Mean of the differences, with the 95 % interval of the paired t-test (from two rounds on).
  Estimate difference;
  /// Whether the interval excludes zero.
  bool is_clear() const;
};

/// A controller compared with the first one.
struct ControllerComparison {
  std::string controller;
  std::size_t rounds = 0;                     ///< in which both controllers stayed up
  int falls = 0;                              ///< of this controller
  std::vector<PairedDifference> differences;  ///< in the order of `quantities`; empty without a round
};

/// A piece of an experiment with alternating controllers.
struct PieceComparison {
  std::string label, first_controller;
  int first_falls = 0;
  std::vector<ControllerComparison> others;
  std::vector<ComparedRun> runs;  ///< in the order they were made
};

/// Mean and interval of differences. There must be at least one.
Estimate paired_difference(const std::vector<double>& differences);

/// Compares runs, which are paired by rounds. The first controller is that of the first run.
PieceComparison compare_in_rounds(std::string label, std::vector<ComparedRun> runs);

/// True for an experiment's folder.
bool holds_experiment(const std::filesystem::path& folder);

/// The comparisons of an experiment's folder, also of an interrupted one. Empty if no controllers alternate.
/// Throws ConfigError if it cannot be read.
std::vector<PieceComparison> paired_comparisons(const std::filesystem::path& folder);

}  // namespace upright
