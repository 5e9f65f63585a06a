// How well a plant balanced, by its own record.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "../fault/process_case.hpp"

namespace upright::test {

/// How far the pendulum leaned at worst, from this long after it was let go until the motor was off.
inline double worst_theta_rad(const std::vector<TraceRow>& rows, double after_s) {
  const double from_s = let_go_s(rows) + after_s, until_s = last_voltage_s(rows);
  double worst_rad = 0.0;
  for (const TraceRow& row : rows)
    if (row.time_s > from_s && row.time_s <= until_s)
      worst_rad = std::max(worst_rad, std::abs(row.theta_rad));
  return worst_rad;
}

}  // namespace upright::test
