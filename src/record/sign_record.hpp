// The record of a sign check, stored beside the rig file. Runs and experiments require
// it.
#pragma once

#include <filesystem>
#include <string>

#include "upright/hal/rig_file.hpp"

namespace upright {

/// Path of the record of a rig file.
std::filesystem::path sign_record_of(const RigFile& rig);
/// True when there is a record with the same link, calibration and amplifier sign.
bool signs_are_checked(const RigFile& rig);
/// Throws ConfigError on hardware without such a record. `otherwise`: alternative in the message.
void require_checked_signs(const RigFile& rig, const std::string& otherwise);
/// Throws Error when it cannot be written.
void write_sign_record(const RigFile& rig, const std::string& sentence);

}  // namespace upright
