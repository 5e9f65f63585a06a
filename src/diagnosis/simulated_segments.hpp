// Measured and simulated side by side: every segment simulated with the recorded voltages and nothing else,
// from the initial state that suits the model best.
#pragma once

#include <vector>

#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// One segment. What a run does not measure, or the model does not have, is empty.
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
