// Experiment files: what is to be measured and why, as a list of pieces that are run in turn. Read strictly,
// each piece written so that it reads back exactly (run.yaml holds the one that made the run).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "piece.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

struct Experiment {
  std::string name;
  std::string why;
  std::filesystem::path plant;  ///< what the plan is made with; empty: not given
  std::filesystem::path gains;  ///< empty: not given
  double sample_rate_hz = 0.0;  ///< 0: the gain file's, or 1000
  double travel_m = 0.0;        ///< the cart stays within +- this
  double voltage_limit_v = 0.0;
  std::vector<Piece> pieces;
  std::string text;               ///< of the file, as it was read
  std::optional<YamlMap> source;  ///< where it was read: for what only the plan can refuse
};

/// Visits the keys of the whole file, for the reader and the schema.
void experiment_keys(PieceKeys& document, Experiment& experiment);

/// Reads an experiment file. Throws ConfigError with remedy, file, line and key.
Experiment read_experiment_file(const std::filesystem::path& file);
/// The same from text; `file` is the name that errors show and that paths start from.
Experiment read_experiment_text(const std::string& text, const std::filesystem::path& file);

}  // namespace upright
