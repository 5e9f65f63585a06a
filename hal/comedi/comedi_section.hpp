// Section `comedi` of a rig file, read and written.
#pragma once

#include <string>

#include "upright/base/yaml_reader.hpp"
#include "upright/hal/comedi_wiring.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// `rig` has been read as far as backends, calibration and amplifier. What the device offers is checked when
/// it is opened. Throws ConfigError.
ComediRig read_comedi(const YamlMap& map, const RigFile& rig);

std::string comedi_text(const ComediRig& rig);

}  // namespace upright
