// Controllers that took turns in an experiment, A, B, A, B: what differs between them, round by round. What a
// rig does over an afternoon (warm bearings, dust) is the same for both runs of a round and leaves their
// difference.
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

/// One quantity of a controller against the first one's, over the rounds in which both stayed up.
struct PairedDifference {
  std::size_t quantity = 0;     ///< place in `quantities`
  double from = 0.0, to = 0.0;  ///< means
  /// Mean of the rounds' differences, with the interval of the paired t-test, 95 percent; none with fewer
  /// than two rounds.
  Estimate difference;
  /// The interval leaves zero out.
  bool is_clear() const;
};

/// A controller against the first one.
struct ControllerComparison {
  std::string controller;
  std::size_t rounds = 0;                     ///< that both did and stayed up in
  int falls = 0;                              ///< of this controller
  std::vector<PairedDifference> differences;  ///< in the order of `quantities`; empty without a round
};

/// A piece of an experiment in which controllers took turns.
struct PieceComparison {
  std::string label, first_controller;
  int first_falls = 0;
  std::vector<ControllerComparison> others;
  std::vector<ComparedRun> runs;  ///< in the order they were made
};

/// Mean and interval of differences; there must be one.
Estimate paired_difference(const std::vector<double>& differences);

/// From runs that are read: those of a round are paired. The first controller is the first run's.
PieceComparison compare_in_rounds(std::string label, std::vector<ComparedRun> runs);

/// True for an experiment's folder.
bool holds_experiment(const std::filesystem::path& folder);

/// Of an experiment's folder, also of one that was interrupted; empty where no controllers took turns. Throws
/// ConfigError where it cannot be read.
std::vector<PieceComparison> paired_comparisons(const std::filesystem::path& folder);

}  // namespace upright
