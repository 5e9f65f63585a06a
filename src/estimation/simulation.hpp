// What a plant does under the voltages of a record, or under a controller that starts where the record does,
// against what was measured.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "segments.hpp"
#include "upright/control/controller.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// The protocol of the nonlinear benchmarks: the initial state is fitted to this many samples.
inline constexpr std::size_t usual_initial_samples = 20;

struct SimulationOptions {
  std::optional<double> from_s;  ///< earlier samples are left out; their voltages still act through a delay
  std::optional<double> horizon_s;  ///< each piece of this length starts anew; empty: the whole record
  std::size_t initial_samples = usual_initial_samples;
};

/// A controller in place of the recorded voltages, at its own sample rate.
struct SimulatedController {
  ControlConfig control;
  double amplifier_limit_v = 0.0;
  /// Makes the model-based parts, for each piece; empty: the controller needs none.
  std::function<ModelParts()> make_parts;
};

/// Simulated minus measured over all samples of a channel. NaN where the channel is not measured or the plant
/// does not have it.
struct ChannelError {
  double rmse = std::numeric_limits<double>::quiet_NaN();
  double percent =
      std::numeric_limits<double>::quiet_NaN();  ///< of the standard deviation of the measurement
  double largest = std::numeric_limits<double>::quiet_NaN();  ///< absolute
  double largest_at_s = std::numeric_limits<double>::quiet_NaN();
};

/// One simulated run. Each vector has a value for each sample of the run, NaN where it is in no piece.
struct RunSimulation {
  std::vector<Segment> pieces;
  std::size_t samples = 0;        ///< in the pieces
  std::vector<double> cart_m;     ///< as the plant's sensor shows it; empty: the cart is locked
  std::vector<double> theta_rad;  ///< as the plant's sensor shows it; empty: the plant has no pendulum
  std::vector<double> voltage_v;  ///< commanded at the sample
  ChannelError cart_error_m, theta_error_rad;
};

/// Simulates `runs` with the event engine. Each piece starts from the position and velocity that fit its
/// first samples best, in units of the sensors' noise. A gap in the record ends a piece; the next one begins
/// when what was commanded in the gap no longer acts. `controllers`: one for each run, or empty for the
/// recorded voltages. Throws ConfigError for a run that has no piece, or no channel in common with the plant.
std::vector<RunSimulation> simulate_runs(const Plant& plant, const std::vector<Measurement>& runs,
                                         const SimulationOptions& options,
                                         const std::vector<SimulatedController>& controllers = {});

}  // namespace upright
