// One run of an experiment, and how it went.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace upright {

/// One run: a piece, one delay of a sweep, or one controller of a comparison.
struct ExperimentTrial {
  std::size_t piece = 0;
  int repeat = 0;
  double delay_s = 0.0;
  std::size_t controller = 0;  ///< place in the piece's controllers
};

/// How a trial went. `outcome`: "done"; in comparisons also "fell"; for delay sweeps "stable", "oscillating"
/// or "fell"; empty where
/// the run ended before what it was to measure had begun, or was cut short: it is no result.
struct TrialResult {
  ExperimentTrial trial;
  std::string run_directory;  ///< within the experiment's folder
  std::string reason;         ///< of the loop's end
  std::string outcome;
  double theta0_rad = 0.0, theta_amplitude_rad = 0.0, cart_amplitude_m = 0.0;
  double fall_time_s = 0.0;   ///< not a number: it did not fall
  double frequency_hz = 0.0;  ///< of the angle; not a number where it does not oscillate
  std::string controller;     ///< of a comparison: its name; otherwise empty
  std::string gains;          ///< the gain file, where the piece balances; characters of CSV replaced
};

}  // namespace upright
