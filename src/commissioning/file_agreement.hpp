// Consistency between files that are valid individually: the checks of `upright check` beyond the
// syntax.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// The files of one run, as far as they are given.
struct RunFiles {
  std::optional<RigFile> rig;
  std::optional<ControlConfig> control;
  std::optional<Plant> plant;  ///< the given model, or the plant of the simulated rig
};

/// Sentences, cause first.
struct Agreement {
  std::vector<std::string> errors;    ///< `run` refuses these files together
  std::vector<std::string> warnings;  ///< `run` accepts them, but they should be checked
};

/// Inconsistencies between the files, and implausible values in each.
Agreement agreement_of(const RunFiles& files);

/// Values that are possible but implausible, most often because of a wrong unit or sign.
std::vector<std::string> doubts_about(const Plant& plant);
std::vector<std::string> doubts_about(const RigFile& rig);
std::vector<std::string> doubts_about(const ControlConfig& control);

}  // namespace upright
