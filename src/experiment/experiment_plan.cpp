// What is known before anything moves: files, limits, and a rehearsal of every piece.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/number_text.hpp"
#include "control/filter_model.hpp"
#include "experiment.hpp"
#include "record/run_log.hpp"
#include "runtime/control_loop.hpp"
#include "upright/base/error.hpp"
#include "upright/control/controller.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

constexpr double default_rate_hz = 1000.0;
/// The loop's own stop at the track limit must stay out of reach of what is planned.
constexpr double room_to_limit_m = 0.02;
/// How far a rehearsal may go beyond the travel: the guard acts on estimates.
constexpr double guard_slack_m = 0.01;
/// Control periods and integration steps of a whole plan: some 10 s of computing, however stiff the plant is.
constexpr std::uint64_t max_rehearsed_steps = 16'000'000;

ControlConfig without_feedback(double rate_hz) {
  ControlConfig control;
  control.sample_rate_hz = rate_hz;
  // The usual filter where it fits below the sampling rate.
  control.estimator.cutoff_hz = std::min(control.estimator.cutoff_hz, rate_hz / 8.0);
  return control;
}

/// Refuses a piece at the key of its file that is to blame. `problem` goes on from "the piece LABEL".
[[noreturn]] void refuse(const Piece& piece, const char* key, const std::string& problem,
                         const std::string& remedy) {
  const std::string sentence = "the piece " + piece.label + " " + problem;
  if (piece.source) piece.source->fail(key, "(" + sentence + ")", remedy);
  throw ConfigError(sentence + ": " + remedy);
}

void refuse_beyond_limits(const ExperimentSetup& setup, double amplifier_limit_v) {
  const Experiment& e = setup.experiment;
  const double widest = setup.rig.track_limit_m - room_to_limit_m;
  if (e.travel_m > widest) {
    const std::string cause = "the rig stops at " + brief_text(setup.rig.track_limit_m) + " m, but " +
                              e.name + " asks for a travel of " + brief_text(e.travel_m) + " m";
    const std::string remedy = "lower travel_m to " + brief_text(widest) + " or less";
    if (e.source) e.source->fail("travel_m", "(" + cause + ")", remedy);
    throw ConfigError(cause + ": " + remedy);
  }
  for (const Piece& piece : e.pieces) {
    const KeyedVoltage largest = largest_voltage(*piece.kind);
    if (largest.key && largest.voltage_v > amplifier_limit_v)
      refuse(piece, largest.key,
             "asks for " + brief_text(largest.voltage_v) + " V, more than the amplifier can give",
             "lower it to at most " + brief_text(amplifier_limit_v) + " V");
    if (!setup.plant.pendulum && piece.kind->needs_pendulum())
      refuse(piece, "kind", "needs a pendulum, but the plant has none",
             "use a plant with a pendulum, or remove the piece");
  }
}

void refuse_unreachable(const Piece& piece, const ExperimentSetup& setup) {
  ScriptContext context;
  context.travel_m = setup.experiment.travel_m;
  context.voltage_limit_v = setup.rig.amplifier.limit_v;
  context.servo = servo_model(setup.plant);
  if (const std::optional<Refusal> why = piece.kind->unreachable(context))
    refuse(piece, why->key, why->problem, why->remedy);
}

/// A rehearsal of a sweep is its shortest delay: the longer ones are there to fall.
Piece first_trial_of(const Piece& piece) {
  return piece_of(piece.kind->rehearsals().front(), piece);
}

struct RehearsalOptions {
  std::uint64_t max_steps = 0;
  bool judges = false;  ///< ends where the piece has failed, and keeps no rows
};

/// Sees the rows of a rehearsal go by, and ends it where it has taken too many steps, or has failed.
class RehearsalSink final : public RowSink {
 public:
  RehearsalSink(const ExperimentScript& script, const SimulatedRigWithHand& rig, double farthest_m,
                const RehearsalOptions& options)
      : script_(script), rig_(rig), farthest_m_(farthest_m), options_(options) {}

  bool push(const LogRecord& row) noexcept override {
    max_v_ = std::max(max_v_, std::abs(row.voltage_v));
    ++periods_;
    if (!options_.judges) rows_.push_back(row);
    const bool failed = options_.judges && (script_.cut_short() > 0 || std::abs(row.cart_m) > farthest_m_);
    if (failed || too_long()) enough_.store(stop_button_pressed, std::memory_order_relaxed);
    return true;
  }
  void push_waiting(const LogRecord& row) noexcept override { push(row); }
  bool failed() const noexcept override { return false; }

  const SignalFlag& enough() const noexcept { return enough_; }
  std::uint64_t steps() const noexcept { return periods_ + rig_.steps_taken(); }
  bool too_long() const noexcept { return steps() >= options_.max_steps; }
  double max_v() const noexcept { return max_v_; }
  std::vector<LogRecord> take_rows() noexcept { return std::move(rows_); }

 private:
  const ExperimentScript& script_;
  const SimulatedRigWithHand& rig_;
  double farthest_m_;
  RehearsalOptions options_;
  std::uint64_t periods_ = 0;
  double max_v_ = 0.0;
  std::vector<LogRecord> rows_;
  SignalFlag enough_{0};
};

Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup, const Plant& real,
                   const RehearsalOptions& options) {
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
  control.delay_s = piece.kind->delay_s();
  Controller controller(control, rig.amplifier.limit_v, make_model_parts(control));
  ExperimentScript script(piece, {control.period_s(), setup.experiment.travel_m, rig.amplifier.limit_v,
                                  servo_model(setup.plant), control.gains});
  controller.follow(&script);
  PoseScaler scaler(calibration_in_use(rig));
  LoopLimits limits = rig_limits(rig, real);
  limits.periods = options.max_steps;
  limits.watchdog_s = 1.0;
  limits.max_periods_late = 1;
  RehearsalSink sink(script, *simulated, setup.experiment.travel_m + guard_slack_m, options);
  LiveStatus live;
  ControlLoop loop(*simulated, clock, controller, scaler, sink, limits, sink.enough(), live);
  Rehearsal rehearsal;
  loop.run(rehearsal.outcome);
  rehearsal.rows = sink.take_rows();
  rehearsal.farthest_m = rehearsal.outcome.worst_cart_m;
  rehearsal.max_v = sink.max_v();
  rehearsal.cut_short = script.cut_short();
  rehearsal.script_over = script.phase() == ScriptPhase::over;
  rehearsal.steps = sink.steps();
  rehearsal.too_long = sink.too_long();
  return rehearsal;
}

/// Plans piece after piece, within a number of steps for all of them.
class Planner {
 public:
  explicit Planner(const ExperimentSetup& setup, std::uint64_t max_steps = max_rehearsed_steps)
      : setup_(setup), steps_left_(max_steps) {}

  PlannedPiece plan(const Piece& piece) { return compares(piece) ? plan_comparison(piece) : plan_one(piece); }

 private:
  PlannedPiece plan_comparison(const Piece& piece) {
    PlannedPiece whole{piece};
    ExperimentSetup with = setup_;
    for (const ExperimentTrial& trial : piece.kind->rehearsals()) {
      with.control = control_of(setup_, piece, trial.controller);
      Piece one = piece_of(trial, piece);
      one.label += " with the gains " + piece.kind->controllers()[trial.controller].name;
      Planner planner(with, steps_left_);
      const PlannedPiece planned = planner.plan_one(one);
      steps_left_ = planner.steps_left_;
      whole.duration_s = std::max(whole.duration_s, planned.duration_s);
      whole.farthest_m = std::max(whole.farthest_m, planned.farthest_m);
      whole.max_v = std::max(whole.max_v, planned.max_v);
    }
    return whole;
  }

  PlannedPiece plan_one(Piece piece) {
    if (!piece.fit_to_travel) refuse_unreachable(piece, setup_);
    constexpr int max_plan_attempts = 16;
    for (int attempt = 0;; ++attempt) {
      const Rehearsal r = rehearsed(piece);
      const bool within = stays_within(r);
      if (within && r.outcome.reason == StopReason::duration)
        return {piece, r.outcome.time_s, r.farthest_m, r.max_v};
      if (within || !piece.fit_to_travel || attempt == max_plan_attempts) refuse_for(piece, r);
      scale_voltages(*piece.kind, 0.8);
    }
  }

  bool stays_within(const Rehearsal& r) const {
    return r.farthest_m <= setup_.experiment.travel_m + guard_slack_m && r.cut_short == 0;
  }

  Rehearsal rehearsed(const Piece& piece) {
    Rehearsal r = rehearse(first_trial_of(piece), setup_, setup_.plant, {steps_left_, true});
    steps_left_ -= std::min(steps_left_, r.steps);
    if (r.too_long && !r.script_over)
      refuse(
          piece, "kind", "and the pieces before it are too long to rehearse",
          "make the pieces shorter, lower the sample rate, or split the file; a stiffness or damping in the "
          "plant file that is far too large has the same effect");
    return r;
  }

  [[noreturn]] void refuse_for(const Piece& piece, const Rehearsal& r) {
    const std::string travel = "+-" + brief_text(setup_.experiment.travel_m) + " m";
    const std::string when = " after " + brief_text(r.outcome.time_s) + " s in the rehearsal";
    if (r.outcome.reason == StopReason::not_ready)
      refuse(piece, "kind", "would not come to rest at its starting point",
             "check the plant file and travel_m");
    if (r.outcome.reason == StopReason::not_finite)
      refuse(piece, "kind", "would ask for a voltage that is not a number" + when,
             "check the gains, the plant file and the piece");
    if (balances(piece))
      refuse(piece, "kind", "would fall, or leave the travel of " + travel + "," + when,
             "use shorter delays, smaller steps or other gains");
    if (const KeyedVoltage amplitude = amplitude_of(*piece.kind); amplitude.key && !stays_within(r)) {
      Piece smaller = piece;
      for (int i = 0; i < 12; ++i) {
        scale_voltages(*smaller.kind, 0.85);
        if (stays_within(rehearsed(smaller))) break;
      }
      refuse(piece, amplitude.key,
             "would leave the travel of " + travel + " at " + brief_text(amplitude.voltage_v) + " V",
             std::string("lower ") + amplitude.key + " to " +
                 brief_text(amplitude_of(*smaller.kind).voltage_v) + ", or set fit_to_travel: true");
    }
    refuse(piece, "kind", "would leave the travel of " + travel + when,
           "increase travel_m, or reduce the motion of the piece");
  }

  const ExperimentSetup& setup_;
  std::uint64_t steps_left_;
};

}  // namespace

namespace {

/// As an experiment uses it: at its rate, each trial with a delay of its own.
ControlConfig on_rig(ControlConfig control, std::optional<double> sample_rate_hz, const RigFile& rig) {
  if (sample_rate_hz) control.sample_rate_hz = *sample_rate_hz;
  control.delay_s = 0.0;
  return with_encoders(control, rig.calibration.cart.per_count, rig.calibration.pendulum.per_count);
}

/// Of an experiment whose only gain files are compared.
double first_rate_hz(const Experiment& experiment) {
  for (const Piece& piece : experiment.pieces)
    if (compares(piece)) return read_gain_file(piece.kind->controllers().front().file).sample_rate_hz;
  return default_rate_hz;
}

}  // namespace

void read_controllers(ExperimentSetup& setup, std::optional<double> sample_rate_hz) {
  const double rate_hz = setup.control.sample_rate_hz;
  for (const Piece& piece : setup.experiment.pieces)
    for (const NamedGains& controller : piece.kind->controllers()) {
      const ControlConfig control = on_rig(read_gain_file(controller.file), sample_rate_hz, setup.rig);
      if (control.sample_rate_hz != rate_hz)
        refuse(piece, "gains",
               "has the gains " + controller.name + " at " + brief_text(control.sample_rate_hz) +
                   " Hz, but the experiment runs at " + brief_text(rate_hz) + " Hz",
               "use gain files with the same rate, or set sample_rate_hz");
      setup.controllers[controller.file] = control;
    }
}

const ControlConfig& control_of(const ExperimentSetup& setup, const Piece& piece, std::size_t controller) {
  return compares(piece) ? setup.controllers.at(piece.kind->controllers()[controller].file) : setup.control;
}

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
    throw ConfigError(
        "planning needs a plant file, because the rig is not simulated: name one with --plant, or as 'plant' "
        "in " +
        file.string());
  if (!sample_rate_hz && e.sample_rate_hz > 0.0) sample_rate_hz = e.sample_rate_hz;
  if (!e.gains.empty())
    setup.control = on_rig(read_gain_file(e.gains), sample_rate_hz, setup.rig);
  else
    setup.control =
        on_rig(without_feedback(sample_rate_hz.value_or(first_rate_hz(e))), sample_rate_hz, setup.rig);
  read_controllers(setup, sample_rate_hz);
  const double amplifier_limit_v = setup.rig.amplifier.limit_v;
  setup.rig.amplifier.limit_v = std::min(amplifier_limit_v, e.voltage_limit_v);
  refuse_beyond_limits(setup, amplifier_limit_v);
  return setup;
}

Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup) {
  return rehearse(piece, setup, setup.plant);
}

Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup, const Plant& real) {
  return rehearse(piece, setup, real, {max_rehearsed_steps, false});
}

std::vector<PlannedPiece> rehearse_all(const ExperimentSetup& setup, const ProgressCallback& progress) {
  Planner planner(setup);
  std::vector<PlannedPiece> planned;
  const auto all = static_cast<double>(setup.experiment.pieces.size());
  for (const Piece& piece : setup.experiment.pieces) {
    if (progress) progress(static_cast<double>(planned.size()) / all, piece.label);
    planned.push_back(planner.plan(piece));
  }
  return planned;
}

std::vector<Piece> plan_pieces(const ExperimentSetup& setup, const ProgressCallback& progress) {
  std::vector<Piece> pieces;
  for (PlannedPiece& planned : rehearse_all(setup, progress)) pieces.push_back(std::move(planned.piece));
  return pieces;
}

Hand hand_for(const Piece& piece) {
  Hand hand;
  hand.pose = {0.0, std::numbers::pi};
  hand.turned = piece.turned;
  piece.kind->place(hand);
  return hand;
}

}  // namespace upright
