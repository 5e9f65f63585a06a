#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

#include "continuous_lanes.hpp"
#include "event_period.hpp"
#include "lane_builds.hpp"
#include "lane_controller.hpp"
#include "lane_model.hpp"
#include "lane_motor.hpp"
#include "lane_results.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/sim/runge_kutta.hpp"

namespace upright {

namespace {

/// How the motion gets through one period with the voltage held: smooth friction.
class SmoothPeriod {
 public:
  using Mask = EveryLane;
  static constexpr bool may_lag = true;
  struct Steps {
    PlantState<Lanes> state{};
    LaneDrive drive;
  };
  static EveryLane arrived(const Steps& /*steps*/) { return {}; }
  static void begin(Steps& steps, EveryLane /*lanes*/, const LaneDrive& drive) { steps.drive = drive; }
  void advance(Steps& steps) const {
    const LaneDrive& drive = steps.drive;
    if (drive.early_s > 0.0) advance(steps.state, drive.early_v, drive.early_s);
    advance(steps.state, drive.late_v, drive.late_s);
  }

  SmoothPeriod(const LaneParts& /*parts*/, const PlantModel<Lanes>& model, const EffectSet& present)
      : rate_of_(smooth_rate_of(model, present)), motor_(model) {
    const Dynamics<Lanes> physics(model);
    const double smoothing = model.smoothing;
    if (smoothing > 0.0) {
      // tanh(smoothing v) turns within about 3 / smoothing; a step may sweep 0.7 / smoothing of it (errors of
      // 1e-8).
      // Near rest of both contacts the loop amplifies errors a hundredfold: there a third of it.
      turning_ = 3.0 / smoothing;
      pivot_turns_ = physics.pivot_is_dry();
      sweep_ = (pivot_turns_ ? 0.25 : 0.7) / smoothing;
    } else if (physics.cart_has_kink()) {
      turning_ = 0.0;
      sweep_ = kink_sweep_mps;
    }
  }

  [[gnu::flatten]] void advance(PlantState<Lanes>& state, const Lanes& motor_v, double period_s) const {
    if (motor_.lags()) return advance_lagging(state, motor_v, period_s);
    const auto rate = [&](const PlantState<Lanes>& s, Stage) { return rate_of_(s, motor_v); };
    const PlantState<Lanes> first = rate(state, Stage::end);
    const int pieces = pieces_for(state, first, period_s);
    const Lanes h(period_s / pieces);
    state = runge_kutta_4(rate, state, first, h);
    for (int i = 1; i < pieces; ++i) state = runge_kutta_4(rate, state, rate(state, Stage::end), h);
  }

 private:
  void advance_lagging(PlantState<Lanes>& state, const Lanes& drive_v, double period_s) const {
    const Lanes after_v = motor_.after(state.motor_v, drive_v, Lanes(period_s));
    int pieces = std::max(pieces_for(state, rate_of_(state, state.motor_v), period_s),
                          pieces_for(state, rate_of_(state, after_v), period_s));
    while (pieces < max_pieces && any(motor_.time_constant_s() < Lanes(period_s / pieces))) pieces *= 2;
    const Lanes h(period_s / pieces);
    for (int i = 0; i < pieces; ++i) {
      const LaggedMotor<Lanes> lagged = motor_.over(state.motor_v, drive_v, h);
      const auto rate = [&](const PlantState<Lanes>& s, Stage stage) {
        return rate_of_(s, stage == Stage::middle ? lagged.middle_v : lagged.end_v);
      };
      state = runge_kutta_4(rate, state, rate_of_(state, lagged.begin_v), h);
      state.motor_v = lagged.after_v;
    }
  }

  static constexpr double kink_sweep_mps = 1e-3;
  static constexpr int max_pieces = 16;

  /// How many steps this period needs: more where a velocity sweeps over the turn of its friction.
  int pieces_for(const PlantState<Lanes>& state, const PlantState<Lanes>& first, double period_s) const {
    if (!(sweep_ > 0.0)) return 1;
    Lanes swept = swept_of(state.cart_mps, first.cart_mps, period_s);
    if (pivot_turns_) swept = larger(swept, swept_of(state.theta_radps, first.theta_radps, period_s));
    int pieces = 1;
    while (pieces < max_pieces && any(swept > Lanes(pieces * sweep_))) pieces *= 2;
    return pieces;
  }
  Lanes swept_of(const Lanes& velocity, const Lanes& rate, double period_s) const {
    const Lanes reach = absolute(rate) * Lanes(period_s);
    return select(absolute(velocity) - reach < Lanes(turning_), reach, Lanes(0.0));
  }

  SmoothRate rate_of_;
  LaneMotor motor_;
  double turning_ = 0.0, sweep_ = 0.0;  ///< [m/s] of the cart, [rad/s] of the pendulum
  bool pivot_turns_ = false;
};

/// Sampled loops. Lanes go in step, or each at its own pace: then whichever has come to the end of its period
/// is controlled, and one whose run has ended takes the next run.
template <class Present, class Period>
class SampledRuns {
 public:
  SampledRuns(const LoopSetup& setup, const LaneParts& parts, const Present& present,
              std::span<const PlantModel<double>> plants, LoopSource& source)
      : setup_(setup),
        parts_(parts),
        present_(present),
        plants_(plants),
        source_(source),
        model_(on_lanes(plants[0])),
        period_(parts, model_, present),
        controller_(setup, parts, model_, source.longest_delay_s()),
        seen_(setup),
        periods_(std::round(setup.duration_s * setup.control.sample_rate_hz)),
        begun_(periods_ + Lanes(1.0)) {}

  /// False: the source had none.
  bool run() {
    if (!fill()) return false;
    const Lanes one(1.0), period_s(setup_.control.period_s());
    for (;;) {
      const Mask arrived = narrowed(Period::arrived(steps_), begun_ <= periods_);
      if (any(arrived)) {
        seen_.take(arrived, begun_ * period_s, steps_.state, controller_.command_v());
        begun_ = select(arrived, begun_ + one, begun_);
        if (!end_runs()) return true;
        control(narrowed(arrived, (begun_ > Lanes(0.0)) & (begun_ <= periods_)));
      }
      period_.advance(steps_);
    }
  }

 private:
  using Mask = typename Period::Mask;
  static constexpr bool in_step = std::is_same_v<Mask, EveryLane>;
  static constexpr std::uint32_t every_lane = (1u << lane_count) - 1u;

  /// Ends the runs that have fallen or gone through all their periods. False: none is left.
  bool end_runs() {
    const std::uint32_t late = (begun_ > periods_).bits();
    if (in_step && seen_.alive() != 0 && late == 0) return true;
    std::uint32_t ended = in_step ? used_ : used_ & (late | ~seen_.alive());
    if (ended == 0) return true;
    for (; ended != 0; ended &= ended - 1) finish(static_cast<std::size_t>(std::countr_zero(ended)));
    return !in_step && fill();
  }

  /// Gives lanes without a run the next ones, as far as there are. In step, the others go along with the last
  /// one. False: no lane has a run.
  [[gnu::noinline]] bool fill() {
    LoopRun run;
    std::uint32_t idle = ~used_ & every_lane;
    for (; idle != 0 && source_.next(run); idle &= idle - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(idle));
      place(lane, run);
      used_ |= 1u << lane;
      seen_.begin(lane);
    }
    if constexpr (in_step)
      for (; idle != 0 && used_ != 0; idle &= idle - 1)
        place(static_cast<std::size_t>(std::countr_zero(idle)), run);
    return used_ != 0;
  }

  /// The lane rests then.
  [[gnu::noinline]] void finish(std::size_t lane) {
    source_.take(run_of_[lane], seen_.finish(lane, steps_.state));
    used_ &= ~(1u << lane);
    put(begun_, lane, periods_.values()[lane] + 1.0);
  }

  /// Puts a lane to the start of this run.
  void place(std::size_t lane, const LoopRun& run) {
    if (run.plant != plant_of_[lane]) become(lane, run.plant);
    run_of_[lane] = run.number;
    controller_.take_delay(lane, run.start.delay_s);
    PlantState<Lanes>& state = steps_.state;
    for (Lanes* number :
         {&state.cart_m, &state.cart_mps, &state.theta_radps, &state.motor_v, &state.bristle_m, &begun_})
      put(*number, lane, 0.0);
    put(state.theta_rad, lane, run.start.theta0_rad);
  }

  /// Gives a lane this plant.
  void become(std::size_t lane, std::size_t plant) {
    plant_of_[lane] = plant;
    put_on_lane(model_, lane, plants_[plant]);
    controller_.take_plant(model_);
    period_ = Period(parts_, model_, present_);
  }

  /// Controls these lanes, of which some may be at the start of their runs.
  void control(const Mask& lanes) {
    const LaneDrive drive = controller_.take(lanes, begun_ == Lanes(1.0), steps_.state);
    if (!Period::may_lag || !controller_.motor_lags()) steps_.state.motor_v = drive.late_v;
    period_.begin(steps_, lanes, drive);
  }

  const LoopSetup& setup_;
  const LaneParts& parts_;
  const Present& present_;
  std::span<const PlantModel<double>> plants_;
  LoopSource& source_;
  PlantModel<Lanes> model_;
  Period period_;
  LaneController<Mask> controller_;
  LaneResults seen_;
  typename Period::Steps steps_;
  Lanes periods_, begun_;
  std::array<std::size_t, lane_count> run_of_{}, plant_of_{};
  std::uint32_t used_ = 0;  ///< bit i: lane i has a run
};

/// False: carts with these effects meet no events.
template <class Present>
bool run_at_own_pace(const LoopSetup& setup, const LaneParts& parts, const Present& present,
                     std::span<const PlantModel<double>> plants, LoopSource& source) {
  if constexpr (may_stick<Present> || may_have_bristles<Present>) {
    SampledRuns<Present, EventPeriod<Present, false>>(setup, parts, present, plants, source).run();
    return true;
  }
  return false;
}

}  // namespace

namespace UPRIGHT_LANES {

std::size_t runs_side_by_side() {
  return lane_count;
}

void run(const LoopSetup& setup, const LaneParts& parts, std::span<const PlantModel<double>> plants,
         LoopSource& source) {
  const EffectSet& present = plants[0].present;
  if (!setup.sampled) return run_continuous_on_lanes(setup, plants[0], source);
  if (parts.pivot_or_lag) {
    SampledRuns<EffectSet, EventPeriod<EffectSet, true>>(setup, parts, present, plants, source).run();
    return;
  }
  const auto at_own_pace = [&](const auto& known) {
    return run_at_own_pace(setup, parts, known, plants, source);
  };
  if (parts.own_pace && with_effects(present, at_own_pace)) return;
  // One group after the other: smooth lanes share their substeps.
  while (SampledRuns<EffectSet, SmoothPeriod>(setup, parts, present, plants, source).run()) {
  }
}

}  // namespace UPRIGHT_LANES

}  // namespace upright
