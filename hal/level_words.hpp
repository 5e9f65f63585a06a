// The levels of a digital line, as rig files name them.
#pragma once

#include "base/yaml_keys.hpp"

namespace upright {

/// Of the key `active`: false, true.
inline constexpr Words<2> level_words = {"low", "high"};

}  // namespace upright
