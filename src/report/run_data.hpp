// The data of a run report: rows to draw, statistics of all rows, and sentences about the outcome.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "html.hpp"
#include "statistics.hpp"
#include "upright/base/progress.hpp"
#include "upright/record/log_record.hpp"

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

  std::uint64_t rows = 0;
  double duration_s = 0.0;  ///< from the first row to the last
  Magnitude theta_rad, cart_m, voltage_requested_v, voltage_v;
  ValueCounts wake_late_ns, read_ns, compute_ns, write_ns;
  std::vector<LogRecord> drawn;    ///< all rows of a short run; of a long one those that a plot can show
  std::vector<LogRecord> closing;  ///< all rows of the last `closing_s`
};

inline constexpr double closing_s = 3.0;

/// Uses constant memory for any length of run. Throws Error if the directory is not a run.
RunData load_run_data(const std::filesystem::path& run_directory, const ProgressCallback& progress = {});

}  // namespace upright
