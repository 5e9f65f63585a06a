// An effect that a disturbance accounts for as well.
#pragma once

#include <cstddef>
#include <string>

namespace upright {

/// An effect, and what does as well as it.
struct OutdoneEffect {
  std::size_t effect = 0;    ///< number in the registry
  std::string where;         ///< a sentence for the listing of effects that help here only
  bool was_average = false;  ///< a constant force is needed in its place
};

}  // namespace upright
