#include "next_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/parallel.hpp"
#include "experiment/experiment.hpp"
#include "upright/base/error.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {

namespace {

constexpr double rate_hz = 500.0;

struct EmbeddedFile {
  const char* path;
  const char* text;
};

constexpr EmbeddedFile embedded[] = {
#include "experiment_library.inc"
};

/// The plan's rig: encoders fine enough not to matter, and the track of the IP02.
ExperimentSetup setup_for(const Experiment& experiment, const Plant& plant) {
  ExperimentSetup setup;
  setup.experiment = experiment;
  setup.plant = plant;
  setup.rig.calibration.cart = {2.27485e-5, 1, 32, 5.0};
  setup.rig.calibration.pendulum = {2.0 * std::numbers::pi / 4096.0, 1, 32, 60.0};
  setup.rig.amplifier.limit_v = experiment.voltage_limit_v;
  setup.rig.track_limit_m = experiment.travel_m + 0.1;
  setup.rig.fall_angle_rad = 0.6;
  setup.rig.watchdog_s = 1.0;
  setup.control.sample_rate_hz = rate_hz;
  return setup;
}

struct Trace {
  std::vector<double> cart_m, theta_rad;
};

/// What another plant would show under the voltages of a rehearsal.
Trace follow(const Plant& plant, const Piece& piece, const std::vector<LogRecord>& rows) {
  const Hand hand = hand_for(piece);
  Simulator<double> simulator(make_model<double>(handled(plant, hand), hand.cart_held));
  PlantState<double> start;
  start.cart_m = hand.pose.cart_m;
  start.theta_rad = plant.pendulum ? hand.pose.theta_rad : 0.0;
  start.cart_mps = hand.push_mps;
  simulator.start(start);
  Trace trace;
  for (const LogRecord& row : rows) {
    const double t = static_cast<double>(row.time_ns) / 1e9;
    simulator.advance_to(t);
    const Outputs<double> y = simulator.engine().outputs();
    trace.cart_m.push_back(y.cart_m);
    trace.theta_rad.push_back(y.theta_rad);
    simulator.command(t, hand.amplifier_off ? 0.0 : row.voltage_v);
  }
  return trace;
}

/// The noise of the sensors, by which differences of their signals are measured.
struct OutputNoise {
  double cart_m = 1e-5, theta_rad = 5e-4;
};

OutputNoise noise_of(const std::vector<Measurement>& runs) {
  OutputNoise noise;
  for (const Measurement& run : runs) {
    if (run.has_cart()) noise.cart_m = run.cart_noise_m();
    if (run.has_theta()) noise.theta_rad = run.theta_noise_rad();
  }
  return noise;
}

/// How far the signals of the nearest alternative are from those of the chosen plant in an experiment: root
/// mean square [sensor noise]. Absent where the chosen plant cannot do the experiment.
std::optional<double> distance_to_nearest(const Experiment& experiment, const Plant& chosen,
                                          const std::vector<std::pair<std::size_t, Plant>>& alternatives,
                                          const OutputNoise& noise) {
  if (!chosen.pendulum && experiment.pieces.front().kind->needs_pendulum()) return std::nullopt;
  const ExperimentSetup setup = setup_for(experiment, chosen);
  std::vector<Piece> pieces;
  try {
    pieces = plan_pieces(setup);
  } catch (const ConfigError&) {
    return std::nullopt;  // this plant cannot do it within the travel
  }
  std::vector<double> sums(alternatives.size(), 0.0);
  std::size_t samples = 0;
  for (const Piece& piece : pieces) {
    const std::vector<LogRecord> rows = rehearse(piece, setup).rows;
    const Trace base = follow(chosen, piece, rows);
    samples += rows.size();
    for (std::size_t i = 0; i < alternatives.size(); ++i) {
      const Trace other = follow(alternatives[i].second, piece, rows);
      for (std::size_t k = 0; k < rows.size(); ++k)
        sums[i] += std::pow((base.cart_m[k] - other.cart_m[k]) / noise.cart_m, 2) +
                   std::pow((base.theta_rad[k] - other.theta_rad[k]) / noise.theta_rad, 2);
    }
  }
  double nearest = std::numeric_limits<double>::infinity();
  for (const double sum : sums)
    nearest = std::min(nearest, std::sqrt(sum / static_cast<double>(std::max<std::size_t>(samples, 1))));
  return nearest;
}

}  // namespace

std::vector<LibraryExperiment> experiment_library() {
  std::vector<LibraryExperiment> library;
  for (const EmbeddedFile& file : embedded)
    library.push_back({file.path, read_experiment_text(file.text, file.path)});
  return library;
}

std::optional<NextExperiment> choose_experiment(
    const Plant& chosen, const std::vector<std::pair<std::size_t, Plant>>& alternatives,
    const std::vector<Measurement>& runs) {
  const OutputNoise noise = noise_of(runs);
  const std::vector<LibraryExperiment> library = experiment_library();
  std::vector<std::optional<double>> distances(library.size());
  parallel_for(library.size(), [&](std::size_t i) {
    distances[i] = distance_to_nearest(library[i].experiment, chosen, alternatives, noise);
  });
  std::optional<NextExperiment> best;
  for (std::size_t i = 0; i < library.size(); ++i) {
    const LibraryExperiment& item = library[i];
    if (distances[i] && (!best || *distances[i] > best->distance))
      best = NextExperiment{item.experiment.name, item.experiment.why, item.file, *distances[i]};
  }
  return best;
}

}  // namespace upright
