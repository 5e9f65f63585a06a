// The section `gpio` of a rig file, read and written.
#pragma once

#include <string>

#include "upright/hal/gpio.hpp"
#include "upright/model/yaml_reader.hpp"

namespace upright {

/// Throws ConfigError with remedy, file, line and key.
GpioRig read_gpio(const YamlMap& map);

std::string gpio_text(const GpioRig& rig);

}  // namespace upright
