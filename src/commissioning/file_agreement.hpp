// Whether files that are right each by itself are right together: what `upright check` says beyond the
// syntax.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// The files of one run, as far as they are known.
struct RunFiles {
  std::optional<RigFile> rig;
  std::optional<ControlConfig> control;
  std::optional<Plant> plant;  ///< the model that was given, or the simulated rig's own
};

/// A sentence each, cause first.
struct Agreement {
  std::vector<std::string> errors;    ///< `run` refuses these files together
  std::vector<std::string> warnings;  ///< `run` takes them, and somebody should look at them
};

/// What is wrong between the files, and what is hard to believe of each.
Agreement agreement_of(const RunFiles& files);

/// Values that are possible and hard to believe: mistakes of a unit or a sign, most often.
std::vector<std::string> doubts_about(const Plant& plant);
std::vector<std::string> doubts_about(const RigFile& rig);
std::vector<std::string> doubts_about(const ControlConfig& control);

}  // namespace upright
