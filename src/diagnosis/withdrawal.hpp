// An effect that was found and is not to be named.
#pragma once

#include <cstddef>
#include <string>

namespace upright {

/// An effect, and why it goes.
struct Withdrawal {
  std::size_t effect = 0;    ///< number in the registry
  std::string where;         ///< a sentence for the listing of effects that help here only
  bool was_average = false;  ///< a constant force is needed in its place
};

}  // namespace upright
