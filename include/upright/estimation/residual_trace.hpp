// The residual of a plant along a run.
#pragma once

#include <cstddef>
#include <vector>

namespace upright {

/// Smoothed residual force and torque along a segment, with the quantities on which they may depend.
struct ResidualTrace {
  std::size_t run = 0;
  std::vector<double> time_s, force_n, torque_nm, cart_m, cart_mps, voltage_v;
};

}  // namespace upright
