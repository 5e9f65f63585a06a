// What a plant leaves unexplained along a run.
#pragma once

#include <cstddef>
#include <vector>

namespace upright {

/// Residual force and torque along a segment, smoothed, with what they are seen against.
struct ResidualTrace {
  std::size_t run = 0;
  std::vector<double> time_s, force_n, torque_nm, cart_m, cart_mps, voltage_v;
};

}  // namespace upright
