// One result of an examination: the observation, its severity and the remedy.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace upright {

enum class Health : std::uint8_t {
  good,
  not_examined,  ///< no result; the remedy says how to examine it
  poor,          ///< the rig runs, with reduced performance
  bad,           ///< do not run the rig
};

/// "good", "not examined", "poor", "bad".
const char* name_of(Health health) noexcept;

struct Finding {
  std::string subject;  ///< "kernel", "link", ...
  Health health = Health::good;
  std::string what;
  std::string remedy;  ///< empty: no action is required
};

/// The worst of all; good when there are none. Findings that were not examined are ignored.
Health verdict_of(const std::vector<Finding>& findings) noexcept;

}  // namespace upright
