// A run as its report needs it: columns by name, and the words for its outcome.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "upright/report/html.hpp"

namespace upright {

struct RunData {
  std::string name;
  std::string origin;  ///< when, where, with what
  Tone tone = Tone::neutral;
  std::string headline;  ///< did it stay up
  std::string reason;    ///< why did it end
  std::vector<std::string> warnings;
  std::vector<std::pair<std::string, std::string>> outcome_facts;
  std::vector<std::pair<std::string, std::string>> provenance;
  std::string run_yaml;
  std::optional<double> period_s;
  std::optional<double> amplifier_limit_v;

  std::vector<double> time_s, cart_m, theta_rad, voltage_requested_v, voltage_v;
  std::vector<double> wake_late_us, read_us, compute_us, write_us;
};

/// Throws Error when the directory is not a run.
RunData load_run_data(const std::filesystem::path& run_directory);

}  // namespace upright
