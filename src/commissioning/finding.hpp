// One line of an examination: what was found, what that means, and what to do about it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace upright {

enum class Health : std::uint8_t {
  good,
  not_examined,  ///< nothing was found out; the remedy says how it would be
  poor,          ///< a rig runs, less well than it could
  bad,           ///< do not run a rig like this
};

/// "good", "not examined", "poor", "bad".
const char* name_of(Health health) noexcept;

struct Finding {
  std::string subject;  ///< "kernel", "link", ...
  Health health = Health::good;
  std::string what;
  std::string remedy;  ///< empty: nothing to do
};

/// The worst of all; good when there are none. What was not examined makes nothing worse.
Health verdict_of(const std::vector<Finding>& findings) noexcept;

}  // namespace upright
