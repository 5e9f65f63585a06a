// Do signs and directions agree on a rig? Low pulses tell: positive voltage must make cart_m grow, and a
// hanging pendulum lags behind the cart. The answer is kept beside the rig file (sign_record.hpp).
#pragma once

#include <string>
#include <vector>

#include "upright/record/log_record.hpp"

namespace upright {

struct SignFinding {
  bool agrees = false;
  std::string sentence;  ///< what was seen, or what to turn round
};

/// Judges the rows of a sign check.
SignFinding judge_signs(const std::vector<LogRecord>& rows, bool has_pendulum);

}  // namespace upright
