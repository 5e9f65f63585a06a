// Do signs and directions agree on a rig? Low pulses tell: positive voltage must make cart_m grow, and a
// hanging pendulum lags behind the cart. The answer is kept beside the rig file; runs and
// experiments ask for it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "upright/hal/rig_file.hpp"
#include "upright/runtime/log_record.hpp"

namespace upright {

struct SignFinding {
  bool agrees = false;
  std::string sentence;  ///< what was seen, or what to turn round
};

/// Judges the rows of a sign check.
SignFinding judge_signs(const std::vector<LogRecord>& rows, bool has_pendulum);

/// Where the record of a rig file is kept.
std::filesystem::path sign_record_of(const RigFile& rig);
/// True when there is a record, of the same link, calibration and amplifier sign.
bool signs_are_checked(const RigFile& rig);
/// Throws ConfigError on hardware without such a record. `otherwise` ends the sentence: what else would do.
void require_checked_signs(const RigFile& rig, const std::string& otherwise);
/// Throws Error when it cannot be written.
void write_sign_record(const RigFile& rig, const std::string& sentence);

}  // namespace upright
