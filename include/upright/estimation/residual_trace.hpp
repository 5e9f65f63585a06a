// The residual of a plant along a run.
#pragma once

#include <cstddef>
#include <vector>

namespace upright {

/// Smoothed residual force and torque along a segment, with the quantities on which they may depend.
struct ResidualTrace {
  std::size_t run = 0;            ///< number of the run, from 0
  std::vector<double> time_s;     ///< of each sample, as those that follow
  std::vector<double> force_n;    ///< that the model lacks on the cart
  std::vector<double> torque_nm;  ///< that the model lacks on the pendulum
  std::vector<double> cart_m;     ///< position of the cart
  std::vector<double> cart_mps;   ///< velocity of the cart
  std::vector<double> voltage_v;  ///< held from then on
};

}  // namespace upright
