// Measured and simulated segments: each segment is simulated open loop with the recorded voltages, from the
// initial state that fits the model best.
#pragma once

#include <vector>

#include "estimation/segments.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// One segment. Quantities that the run does not measure or the model does not have are empty.
struct SimulatedSegment {
  std::size_t run = 0;
  std::vector<double> time_s, voltage_v;
  std::vector<double> cart_m, simulated_cart_m;
  std::vector<double> theta_rad, simulated_theta_rad;
};

std::vector<SimulatedSegment> simulate_segments(const Plant& plant, const std::vector<Measurement>& runs,
                                                const std::vector<Segment>& segments);

/// The segments that a diagnosis held out.
std::vector<Segment> held_out_segments(const Diagnosis& diagnosis, const std::vector<Measurement>& runs);

}  // namespace upright
