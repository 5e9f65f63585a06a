#include "finding.hpp"

#include <algorithm>

namespace upright {

const char* name_of(Health health) noexcept {
  switch (health) {
    case Health::good:
      return "good";
    case Health::not_examined:
      return "not examined";
    case Health::poor:
      return "poor";
    case Health::bad:
      return "bad";
  }
  return "unknown";
}

Health verdict_of(const std::vector<Finding>& findings) noexcept {
  Health worst = Health::good;
  for (const Finding& finding : findings)
    if (finding.health != Health::not_examined) worst = std::max(worst, finding.health);
  return worst;
}

}  // namespace upright
