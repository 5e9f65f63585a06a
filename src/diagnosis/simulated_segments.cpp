#include "simulated_segments.hpp"

#include <algorithm>

namespace upright {

std::vector<SimulatedSegment> simulate_segments(const Plant& plant, const std::vector<Measurement>& runs,
                                                const std::vector<Segment>& segments) {
  const FitData data{&runs, segments};
  // Without force and torque noise the filter is a plain simulation.
  const FitPoint guess{plant, estimate_initial_states(runs, segments, plant), {}};
  const FitPoint point = fit_initial_states(data, guess).point;
  const std::vector<std::vector<LinearStep>> steps = linearise(data, point);
  std::vector<SimulatedSegment> traces;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const Measurement& run = runs[segments[s].run];
    const bool has_theta = run.has_theta() && plant.pendulum.has_value();
    SimulatedSegment trace;
    trace.run = segments[s].run;
    for (std::size_t i = 0; i < steps[s].size(); ++i) {
      const std::size_t k = segments[s].first + i;
      trace.time_s.push_back(run.time_s[k]);
      trace.voltage_v.push_back(run.voltage_v[k]);
      if (run.has_cart()) {
        trace.cart_m.push_back(run.cart_m[k]);
        trace.simulated_cart_m.push_back(run.cart_m[k] - steps[s][i].residual[0]);
      }
      if (has_theta) {
        trace.theta_rad.push_back(run.theta_rad[k]);
        trace.simulated_theta_rad.push_back(run.theta_rad[k] - steps[s][i].residual[1]);
      }
    }
    traces.push_back(std::move(trace));
  }
  return traces;
}

std::vector<Segment> held_out_segments(const Diagnosis& diagnosis, const std::vector<Measurement>& runs) {
  std::vector<Segment> segments;
  for (const ResidualTrace& trace : diagnosis.residual_after) {
    const std::vector<double>& time = runs[trace.run].time_s;
    const auto place = [&](double t) {
      return static_cast<std::size_t>(std::lower_bound(time.begin(), time.end(), t) - time.begin());
    };
    segments.push_back({trace.run, place(trace.time_s.front()), place(trace.time_s.back())});
  }
  return segments;
}

}  // namespace upright
