// What is known before anything moves: files, limits, and a rehearsal of every piece.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "upright/control/predictor.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/experiment.hpp"

namespace upright {

namespace {

constexpr double default_rate_hz = 1000.0;
/// The loop's own stop at the track limit must stay out of reach of what is planned.
constexpr double room_to_limit_m = 0.02;
/// How far a rehearsal may go beyond the travel: the guard acts on estimates.
constexpr double guard_slack_m = 0.01;
constexpr double longest_rehearsal_s = 3600.0;
constexpr double steady_s = 0.15;  // at constant speed, to be worth measuring

std::string brief(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

ControlConfig without_feedback(double rate_hz) {
  ControlConfig control;
  control.sample_rate_hz = rate_hz;
  // The usual filter where it fits below the sampling rate.
  control.estimator.cutoff_hz = std::min(control.estimator.cutoff_hz, rate_hz / 8.0);
  return control;
}

std::string about(const Piece& piece) {
  return ": the piece " + piece.label;
}

void refuse_beyond_limits(const ExperimentSetup& setup, double amplifier_limit_v) {
  const Experiment& e = setup.experiment;
  const double widest = setup.rig.track_limit_m - room_to_limit_m;
  if (e.travel_m > widest)
    throw ConfigError("lower travel_m to " + brief(widest) + " or less: the rig stops at " +
                      brief(setup.rig.track_limit_m) + " m, and " + e.name + " plans to " +
                      brief(e.travel_m) + " m");
  for (const Piece& piece : e.pieces) {
    double most = std::max(piece.amplitude_v, piece.largest_v);
    for (const double v : piece.voltages_v) most = std::max(most, v);
    if (most > amplifier_limit_v)
      throw ConfigError("lower its voltage to the amplifier's " + brief(amplifier_limit_v) + " V" +
                        about(piece) + " asks for " + brief(most) + " V");
    if (!setup.plant.pendulum && (balances(piece) || piece.kind == PieceKind::free_decay))
      throw ConfigError("use a plant with a pendulum, or leave it out" + about(piece) + " needs one");
    ControlConfig control = setup.control;
    for (const double delay : piece.delays_s) DelayLine(delay, control.period_s());
    DelayLine(piece.delay_s, control.period_s());
  }
}

/// A constant voltage must reach its speed on the travel.
void refuse_short_travel(const Piece& piece, const ExperimentSetup& setup) {
  const ServoModel m = servo_model(setup.plant);
  const double tau = m.mass_kg / std::max(m.damping_n_per_mps, 1e-6);
  const double room = 2.0 * setup.experiment.travel_m;
  const auto needed = [&](double v) {
    const double speed = std::max(0.0, (m.force_per_volt_n * v - m.sliding_n) / m.damping_n_per_mps);
    ScriptContext context;
    context.voltage_limit_v = setup.rig.amplifier.limit_v;
    context.servo = m;
    ControlState now;
    now.cart_velocity_mps = speed;
    const double stop = ExperimentScript(piece, context).stop_position_m(now);
    return speed * (3.0 * tau - tau * (1.0 - std::exp(-3.0)) + steady_s) + stop + 0.03;
  };
  for (const double v : piece.voltages_v) {
    if (m.force_per_volt_n * v <= 1.05 * m.sliding_n)
      throw ConfigError("raise the voltage above " + brief(1.05 * m.sliding_n / m.force_per_volt_n) + " V" +
                        about(piece) + " would not keep the cart moving at " + brief(v) + " V");
    if (needed(v) <= room) continue;
    double fits = v;
    while (fits > 0.05 && needed(fits) > room) fits *= 0.98;
    throw ConfigError("lower the voltage to " + brief(fits) + " V or give travel_m " +
                      brief(0.5 * needed(v)) + about(piece) + " needs " + brief(needed(v)) +
                      " m to reach its speed at " + brief(v) + " V and to stop, and has " + brief(room) +
                      " m");
  }
}

void scale(Piece& piece, double factor) {
  piece.amplitude_v *= factor;
  for (double& v : piece.voltages_v) v *= factor;
}

/// A rehearsal of a sweep is its shortest delay: the longer ones are there to fall.
Piece first_trial_of(Piece piece) {
  if (piece.kind == PieceKind::delay_sweep) {
    piece.delay_s = piece.delays_s.front();
    piece.delays_s = {piece.delay_s};
  }
  return piece;
}

Piece planned(Piece piece, const ExperimentSetup& setup) {
  const double travel = setup.experiment.travel_m;
  if (piece.kind == PieceKind::constant_voltage && !piece.fit_to_travel) refuse_short_travel(piece, setup);
  for (int attempt = 0;; ++attempt) {
    const Rehearsal r = rehearse(first_trial_of(piece), setup);
    const bool within = r.farthest_m <= travel + guard_slack_m && r.cut_short == 0;
    if (within && r.outcome.reason == StopReason::duration) return piece;
    constexpr int most_attempts = 16;
    if (!within && piece.fit_to_travel && attempt < most_attempts) {
      scale(piece, 0.8);
      continue;
    }
    if (r.outcome.reason == StopReason::not_ready)
      throw ConfigError("check the plant file and travel_m" + about(piece) +
                        " would not come to rest where it starts");
    if (r.outcome.reason == StopReason::fell)
      throw ConfigError("use shorter delays, smaller steps or other gains" + about(piece) +
                        " would fall after " + brief(r.outcome.time_s) + " s by the plan");
    if (piece.amplitude_v > 0.0) {
      Piece smaller = piece;
      double fits = piece.amplitude_v;
      for (int i = 0; i < 12; ++i) {
        scale(smaller, 0.85);
        fits = smaller.amplitude_v;
        const Rehearsal again = rehearse(smaller, setup);
        if (again.cut_short == 0 && again.farthest_m <= travel + guard_slack_m) break;
      }
      throw ConfigError("lower amplitude_v to " + brief(fits) + " or set fit_to_travel: true" + about(piece) +
                        " would leave the travel of +-" + brief(travel) + " m at " +
                        brief(piece.amplitude_v) + " V");
    }
    throw ConfigError("enlarge travel_m or make the piece smaller" + about(piece) + " would go to " +
                      brief(r.farthest_m) + " m of the allowed " + brief(travel) + " m");
  }
}

}  // namespace

ExperimentSetup resolve_experiment(const std::filesystem::path& file, const std::filesystem::path& rig,
                                   const std::filesystem::path& plant, std::optional<double> sample_rate_hz) {
  ExperimentSetup setup;
  setup.experiment = read_experiment_file(file);
  setup.rig = read_rig_file(rig);
  const Experiment& e = setup.experiment;
  const bool simulated = is_simulated(setup.rig);
  if (simulated) setup.simulated = read_plant_file(setup.rig.simulated->plant);
  if (!plant.empty())
    setup.plant = read_plant_file(plant);
  else if (simulated)
    setup.plant = *setup.simulated;
  else if (!e.plant.empty())
    setup.plant = read_plant_file(e.plant);
  else
    throw ConfigError("name what to plan with, --plant PLANT or plant in " + file.string() +
                      ": the rig is not simulated");
  if (!e.gains.empty())
    setup.control = read_gain_file(e.gains);
  else
    setup.control = without_feedback(default_rate_hz);
  if (e.sample_rate_hz > 0.0) setup.control.sample_rate_hz = e.sample_rate_hz;
  if (sample_rate_hz) setup.control.sample_rate_hz = *sample_rate_hz;
  if (e.gains.empty()) setup.control = without_feedback(setup.control.sample_rate_hz);
  setup.control.delay_s = 0.0;
  const double amplifier_limit_v = setup.rig.amplifier.limit_v;
  setup.rig.amplifier.limit_v = std::min(amplifier_limit_v, e.voltage_limit_v);
  refuse_beyond_limits(setup, amplifier_limit_v);
  return setup;
}

Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup) {
  return rehearse(piece, setup, setup.plant);
}

Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup, const Plant& real) {
  RigFile rig = setup.rig;
  rig.cart_encoder = rig.pendulum_encoder = rig.output = Backend::simulated;
  rig.calibration.zero_at_start = false;
  rig.simulated = SimulatedRig{};
  rig.simulated->initial = {0.0, std::numbers::pi};
  VirtualClock clock;
  const auto simulated = make_simulated_rig(rig, real, clock, {});
  simulated->open();
  simulated->handle(hand_for(piece));
  ControlConfig control = setup.control;
  control.delay_s = piece.delay_s;
  Controller controller(control, rig.amplifier.limit_v, make_compensator(control));
  ExperimentScript script(piece, {control.period_s(), setup.experiment.travel_m, rig.amplifier.limit_v,
                                  servo_model(setup.plant), control.gains});
  controller.follow(&script);
  PoseScaler scaler(calibration_in_use(rig));
  LoopLimits limits;
  limits.periods = static_cast<std::uint64_t>(longest_rehearsal_s * control.sample_rate_hz);
  limits.track_limit_m = rig.track_limit_m;
  limits.fall_angle_rad = rig.fall_angle_rad;
  limits.watchdog_s = 1.0;
  limits.most_periods_late = 1;
  RowMemory memory;
  const SignalFlag no_signal{0};
  LiveStatus live;
  ControlLoop loop(*simulated, clock, controller, scaler, memory, limits, no_signal, live);
  Rehearsal rehearsal;
  loop.run(rehearsal.outcome);
  rehearsal.rows = memory.take();
  rehearsal.farthest_m = rehearsal.outcome.worst_cart_m;
  rehearsal.cut_short = script.cut_short();
  return rehearsal;
}

std::vector<Piece> plan_pieces(const ExperimentSetup& setup) {
  std::vector<Piece> pieces;
  for (const Piece& piece : setup.experiment.pieces) pieces.push_back(planned(piece, setup));
  return pieces;
}

Hand hand_for(const Piece& piece) {
  Hand hand;
  hand.pose = {0.0, std::numbers::pi};
  hand.turned = piece.turned;
  hand.amplifier_off = piece.amplifier_off;
  hand.push_mps = piece.push_mps;
  constexpr double holds_s = 2.0;
  if (piece.kind == PieceKind::free_decay) {
    hand.pose.theta_rad = std::numbers::pi - piece.angle_rad;
    hand.cart_held = true;
    hand.holds_s = 0.7;
  } else if (balances(piece) && piece.start == StartBy::hand) {
    hand.pose.theta_rad = piece.theta0_rad;
    hand.holds_s = holds_s;
  }
  return hand;
}

}  // namespace upright
