#include "simulation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "base/number_text.hpp"
#include "base/parallel.hpp"
#include "fit.hpp"
#include "segment_start.hpp"
#include "simulation_pieces.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

constexpr double not_simulated = std::numeric_limits<double>::quiet_NaN();

/// One piece of a run, from its initial state to its last sample. Fills its part of the run's simulation.
class PieceSimulation {
 public:
  PieceSimulation(const Plant& plant, const Measurement& run, const Segment& piece,
                  const PlantState<double>& start, std::size_t max_commands, RunSimulation& result)
      : run_(run),
        piece_(piece),
        result_(result),
        simulator_(make_model_of_run<double>(plant, run), {}, max_commands) {
    start_segment(simulator_, run, piece, start);
  }

  void follow_record() {
    for (std::size_t k = piece_.first; k <= piece_.last; ++k) {
      simulator_.advance_to(run_.time_s[k]);
      keep(k, run_.voltage_v[k]);
      command_from(k, run_, simulator_);
    }
  }

  /// With the readings of the run's encoders, from the first sample on, at the controller's own rate.
  void follow(const SimulatedController& with) {
    Controller controller(with.control, with.amplifier_limit_v,
                          with.make_parts ? with.make_parts() : ModelParts{});
    const double begin_s = run_.time_s[piece_.first], period_s = with.control.period_s();
    // The pendulum may have turned round before: upright is the nearest turn.
    constexpr double turn = 2.0 * std::numbers::pi;
    const double upright_rad = turn * std::round(simulator_.engine().outputs().theta_rad / turn);
    double voltage_v = 0.0;
    std::uint64_t tick = 0;
    const auto control_until = [&](double time_s) {
      constexpr double slack_periods = 1e-6;  // a row at the time of a sample shows its voltage
      const double until_s = time_s + slack_periods * period_s;
      for (double at_s; (at_s = begin_s + static_cast<double>(tick) * period_s) <= until_s;) {
        simulator_.advance_to(at_s);
        const Outputs<double> shown = simulator_.engine().outputs();
        voltage_v = controller
                        .step({tick++, read(shown.cart_m, run_.cart_resolution_m),
                               read(shown.theta_rad, run_.theta_resolution_rad) - upright_rad, 0.0})
                        .voltage_v;
        simulator_.command(at_s, voltage_v);
      }
    };
    for (std::size_t k = piece_.first; k <= piece_.last; ++k) {
      control_until(run_.time_s[k]);
      simulator_.advance_to(run_.time_s[k]);
      keep(k, voltage_v);
    }
  }

 private:
  static double read(double value, double resolution) {
    return resolution > 0.0 ? resolution * std::round(value / resolution) : value;
  }

  void keep(std::size_t k, double voltage_v) {
    const Outputs<double> shown = simulator_.engine().outputs();
    if (!result_.cart_m.empty()) result_.cart_m[k] = shown.cart_m;
    if (!result_.theta_rad.empty()) result_.theta_rad[k] = shown.theta_rad;
    result_.voltage_v[k] = voltage_v;
  }

  const Measurement& run_;
  const Segment& piece_;
  RunSimulation& result_;
  Simulator<double> simulator_;
};

/// Without a measurement, or a channel of the plant, there is none.
ChannelError channel_error(const Measurement& run, const RunSimulation& simulation,
                           const std::vector<double>& measured, const std::vector<double>& simulated) {
  ChannelError error;
  if (measured.empty() || simulated.empty()) return error;
  const auto of_each_sample = [&](const auto& take) {
    for (const Segment& piece : simulation.pieces)
      for (std::size_t k = piece.first; k <= piece.last; ++k) take(k);
  };
  const auto count = static_cast<double>(simulation.samples);
  double squares = 0.0, mean = 0.0, variance = 0.0;
  error.largest = 0.0;
  of_each_sample([&](std::size_t k) {
    const double off = std::abs(simulated[k] - measured[k]);
    squares += off * off / count;
    mean += measured[k] / count;
    if (off > error.largest) {
      error.largest = off;
      error.largest_at_s = run.time_s[k];
    }
  });
  of_each_sample([&](std::size_t k) { variance += std::pow(measured[k] - mean, 2) / count; });
  error.rmse = std::sqrt(squares);
  if (variance > 0.0) error.percent = 100.0 * error.rmse / std::sqrt(variance);
  return error;
}

/// Nothing to compare, or too short.
void refuse_unfit(const Plant& plant, const Measurement& run, const RunSimulation& simulation,
                  const SimulationOptions& options) {
  if (!run.has_cart() && !plant.pendulum)
    throw ConfigError(run.name +
                      " holds only the pendulum's angle, and the plant file has no pendulum: add it "
                      "to the plant file");
  if (!simulation.pieces.empty()) return;
  const std::string needed = std::to_string(options.initial_samples);
  throw ConfigError(run.name + " has no piece with the " + needed +
                    " samples to which the initial state is fitted" +
                    (options.horizon_s || options.from_s ? ": choose a longer --horizon or an earlier --from"
                                                         : ": record a longer run without gaps"));
}

/// The samples to which the initial states are fitted, of all pieces.
std::vector<PlantState<double>> initial_states(const Plant& plant, const std::vector<Measurement>& runs,
                                               const std::vector<Segment>& pieces, std::size_t samples) {
  std::vector<Segment> beginnings = pieces;
  for (Segment& piece : beginnings) piece.last = std::min(piece.last, piece.first + samples - 1);
  const FitData data{&runs, beginnings};
  // The fit stops where a step is small against the noise. With less noise it comes as near to least squares
  // as anybody could check.
  Noise noise;
  noise.sensors = 1e-3;
  const FitPoint guess{plant, estimate_initial_states(runs, beginnings, plant), noise};
  return fit_initial_states(data, guess).point.starts;
}

/// Infinite numbers are no simulation.
void refuse_diverged(const Measurement& run, const RunSimulation& simulation) {
  for (const Segment& piece : simulation.pieces)
    for (std::size_t k = piece.first; k <= piece.last; ++k) {
      const bool finite = (simulation.cart_m.empty() || std::isfinite(simulation.cart_m[k])) &&
                          (simulation.theta_rad.empty() || std::isfinite(simulation.theta_rad[k]));
      if (finite) continue;
      throw ConfigError("the simulation of " + run.name + " is not finite from " +
                        number_text(run.time_s[k]) +
                        " s on: the numbers of the plant file give forces that grow without limit or change "
                        "faster than any step follows. Check its effects");
    }
}

std::size_t max_commands(const Measurement& run, const Segment& piece, const SimulatedController* controller,
                         double delay_s) {
  std::size_t count = max_commands(run, piece);
  if (controller != nullptr) count += static_cast<std::size_t>(delay_s * controller->control.sample_rate_hz);
  return count;
}

}  // namespace

std::vector<RunSimulation> simulate_runs(const Plant& plant, const std::vector<Measurement>& runs,
                                         const SimulationOptions& options,
                                         const std::vector<SimulatedController>& controllers) {
  std::vector<RunSimulation> simulations(runs.size());
  std::vector<Segment> pieces;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    RunSimulation& simulation = simulations[r];
    simulation.pieces = simulation_pieces(runs[r], r, plant, options);
    refuse_unfit(plant, runs[r], simulation, options);
    if (!runs[r].cart_locked) simulation.cart_m.assign(runs[r].size(), not_simulated);
    if (plant.pendulum) simulation.theta_rad.assign(runs[r].size(), not_simulated);
    simulation.voltage_v.assign(runs[r].size(), not_simulated);
    for (const Segment& piece : simulation.pieces) simulation.samples += piece.last - piece.first + 1;
    pieces.insert(pieces.end(), simulation.pieces.begin(), simulation.pieces.end());
  }
  const std::vector<PlantState<double>> starts = initial_states(plant, runs, pieces, options.initial_samples);
  const double delay_s = Dynamics<double>(make_model<double>(plant)).input_delay_s();
  parallel_for(pieces.size(), [&](std::size_t i) {
    const std::size_t r = pieces[i].run;
    const SimulatedController* controller = controllers.empty() ? nullptr : &controllers[r];
    PieceSimulation piece(plant, runs[r], pieces[i], starts[i],
                          max_commands(runs[r], pieces[i], controller, delay_s), simulations[r]);
    if (controller != nullptr) {
      piece.follow(*controller);
    } else {
      piece.follow_record();
    }
  });
  for (std::size_t r = 0; r < runs.size(); ++r) {
    RunSimulation& simulation = simulations[r];
    refuse_diverged(runs[r], simulation);
    simulation.cart_error_m = channel_error(runs[r], simulation, runs[r].cart_m, simulation.cart_m);
    simulation.theta_error_rad = channel_error(runs[r], simulation, runs[r].theta_rad, simulation.theta_rad);
  }
  return simulations;
}

}  // namespace upright
