// Checks the signs of a rig with low voltage pulses: positive voltage must increase cart_m, and a hanging
// pendulum lags behind the cart. The result is stored beside the rig file (sign_record.hpp).
#pragma once

#include <string>
#include <vector>

#include "upright/record/log_record.hpp"

namespace upright {

struct SignFinding {
  bool agrees = false;
  std::string sentence;  ///< the observation, or the sign to reverse
};

/// Evaluates the rows of a sign check.
SignFinding judge_signs(const std::vector<LogRecord>& rows, bool has_pendulum);

}  // namespace upright
