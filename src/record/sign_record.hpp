// Whether somebody checked the signs of a rig: a record beside the rig file, which runs and experiments ask
// for.
#pragma once

#include <filesystem>
#include <string>

#include "upright/hal/rig_file.hpp"

namespace upright {

/// Where the record of a rig file is kept.
std::filesystem::path sign_record_of(const RigFile& rig);
/// True when there is a record, of the same link, calibration and amplifier sign.
bool signs_are_checked(const RigFile& rig);
/// Throws ConfigError on hardware without such a record. `otherwise` ends the sentence: what else would do.
void require_checked_signs(const RigFile& rig, const std::string& otherwise);
/// Throws Error when it cannot be written.
void write_sign_record(const RigFile& rig, const std::string& sentence);

}  // namespace upright
