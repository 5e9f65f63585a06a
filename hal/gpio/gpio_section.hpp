// The section `gpio` of a rig file, read and written.
#pragma once

#include <string>

#include "upright/base/yaml_reader.hpp"
#include "upright/hal/gpio.hpp"

namespace upright {

/// Throws ConfigError with remedy, file, line and key.
GpioRig read_gpio(const YamlMap& map);

std::string gpio_text(const GpioRig& rig);

}  // namespace upright
