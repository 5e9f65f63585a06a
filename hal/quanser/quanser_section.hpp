// Section `quanser_hil` of a rig file, read and written.
#pragma once

#include <string>

#include "upright/base/yaml_reader.hpp"
#include "upright/hal/quanser_wiring.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// `rig` has been read as far as backends, calibration and amplifier; both are narrowed to what the card can
/// do where the file leaves it open: counters are followed at the card's own width, and without
/// `output_range_v` and `amplifier_gain` the amplifier's limit is at most what the card puts out. Throws
/// ConfigError.
QuanserRig read_quanser(const YamlMap& map, RigFile& rig);

std::string quanser_text(const QuanserRig& rig);

}  // namespace upright
