#include <algorithm>
#include <cmath>
#include <optional>

#include "continuous_lanes.hpp"
#include "control/whole_periods.hpp"
#include "event_period.hpp"
#include "lane_builds.hpp"
#include "lane_model.hpp"
#include "lane_motor.hpp"
#include "lane_observer.hpp"
#include "lane_results.hpp"
#include "lane_ring.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/sim/runge_kutta.hpp"

namespace upright {

namespace {

/// Feedback voltages on their way. The feedback is linear, so that delaying the voltage is delaying the
/// state.
template <class Mask>
class LaneDelay {
 public:
  LaneDelay(std::span<const LoopCase> cases, double period_s) : ring_(longest_of(cases, period_s) + 1) {
    std::array<double, lane_count> fraction{};
    for (std::size_t i = 0; i < lane_count; ++i) {
      const DelayLine line(cases[std::min(i, cases.size() - 1)].delay_s, period_s);
      whole_[i] = line.whole_periods();
      fraction[i] = line.fraction();
      same_ = same_ && whole_[i] == whole_[0];
      exact_ = exact_ && line.exact();
    }
    fraction_ = Lanes::load(fraction.data());
  }

  void start(const Lanes& volts) { ring_.fill(volts); }

  Lanes pass(const Mask& lanes, const Lanes& volts) {
    ring_.push(lanes, volts);
    const Lanes later = back(0);
    if (exact_) return later;
    return later + fraction_ * (back(1) - later);
  }

 private:
  static std::size_t longest_of(std::span<const LoopCase> cases, double period_s) {
    std::size_t longest = 0;
    for (const LoopCase& run : cases)
      longest = std::max(longest, DelayLine(run.delay_s, period_s).whole_periods());
    return longest;
  }
  Lanes back(std::size_t more) const { return same_ ? ring_.ago(whole_[0] + more) : ring_.ago(whole_, more); }

  LaneRing<Mask> ring_;
  std::array<std::size_t, lane_count> whole_{};
  Lanes fraction_;
  bool same_ = true, exact_ = true;
};

/// The plant's own input delay, the same for all lanes. Before the first command zero volts are commanded.
template <class Mask>
class LaneInput {
 public:
  LaneInput(const Dynamics<Lanes>& chain, double period_s)
      : delay_(whole_periods(chain.input_delay_s().values()[0], period_s)),
        period_s_(period_s),
        drives_(delay_.whole + 1) {
    drives_.fill(chain.actuate(Lanes(0.0)));
  }

  LaneDrive pass(const Mask& lanes, const Lanes& drive_v) {
    if (delay_.whole == 0 && delay_.fraction == 0.0) return {drive_v, drive_v, 0.0, period_s_};
    drives_.push(lanes, drive_v);
    const double early_s = delay_.fraction * period_s_;
    return {drives_.ago(delay_.whole + 1), drives_.ago(delay_.whole), early_s, period_s_ - early_s};
  }

 private:
  WholePeriods delay_;
  double period_s_;
  LaneRing<Mask> drives_;
};

/// How the motion gets through one period with the voltage held: smooth friction.
template <class Present>
class SmoothPeriod {
 public:
  using Mask = EveryLane;
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

  SmoothPeriod(const LoopSetup& setup, const PlantModel<Lanes>& model, const Present& present)
      : physics_(model, present), motor_(model) {
    const double smoothing = setup.model.smoothing;
    if (smoothing > 0.0) {
      // tanh(smoothing v) turns within about 3 / smoothing; a step may sweep 0.7 / smoothing of it (errors of
      // 1e-8).
      turning_mps_ = 3.0 / smoothing;
      sweep_mps_ = 0.7 / smoothing;
    } else if (physics_.cart_has_kink()) {
      turning_mps_ = 0.0;
      sweep_mps_ = kink_sweep_mps;
    }
  }

  [[gnu::flatten]] void advance(PlantState<Lanes>& state, const Lanes& motor_v, double period_s) const {
    if (motor_.lags()) return advance_lagging(state, motor_v, period_s);
    const auto rate = [&](const PlantState<Lanes>& s, Stage) { return rate_of(s, motor_v); };
    const PlantState<Lanes> first = rate(state, Stage::end);
    const int pieces = pieces_for(state, first, period_s);
    const Lanes h(period_s / pieces);
    state = runge_kutta_4(rate, state, first, h);
    for (int i = 1; i < pieces; ++i) state = runge_kutta_4(rate, state, rate(state, Stage::end), h);
  }

 private:
  // One copy for all nine stages, which takes no longer to run and half as long to compile. (With stick-slip
  // a copy for each is 2 to 4 percent faster.)
  [[gnu::flatten, gnu::noinline]] PlantState<Lanes> rate_of(const PlantState<Lanes>& state,
                                                            const Lanes& motor_v) const {
    return physics_.derivative(state, motor_v, {});
  }

  void advance_lagging(PlantState<Lanes>& state, const Lanes& drive_v, double period_s) const {
    const LaggedMotor<Lanes> whole = motor_.over(state.motor_v, drive_v, Lanes(period_s));
    const Lanes mean_v = (whole.begin_v + Lanes(4.0) * whole.middle_v + whole.end_v) * Lanes(1.0 / 6.0);
    int pieces = pieces_for(state, rate_of(state, mean_v), period_s);
    while (pieces < max_pieces && any(motor_.time_constant_s() < Lanes(period_s / pieces))) pieces *= 2;
    const Lanes h(period_s / pieces);
    for (int i = 0; i < pieces; ++i) {
      const LaggedMotor<Lanes> lagged = motor_.over(state.motor_v, drive_v, h);
      const auto rate = [&](const PlantState<Lanes>& s, Stage stage) {
        return rate_of(s, stage == Stage::middle ? lagged.middle_v : lagged.end_v);
      };
      state = runge_kutta_4(rate, state, rate_of(state, lagged.begin_v), h);
      state.motor_v = lagged.after_v;
    }
  }

  static constexpr double kink_sweep_mps = 1e-3;
  static constexpr int max_pieces = 16;

  /// How many steps this period needs: more where the velocity sweeps over the turn of the friction.
  int pieces_for(const PlantState<Lanes>& state, const PlantState<Lanes>& first, double period_s) const {
    if (!(sweep_mps_ > 0.0)) return 1;
    const Lanes reach = absolute(first.cart_mps) * Lanes(period_s);
    const LaneMask near = absolute(state.cart_mps) - reach < Lanes(turning_mps_);
    const Lanes swept = select(near, reach, Lanes(0.0));
    int pieces = 1;
    while (pieces < max_pieces && any(swept > Lanes(pieces * sweep_mps_))) pieces *= 2;
    return pieces;
  }

  Dynamics<Lanes, Present> physics_;
  LaneMotor motor_;
  double turning_mps_ = 0.0, sweep_mps_ = 0.0;
};

EveryLane narrowed(EveryLane lanes, const LaneMask& /*to*/) {
  return lanes;
}
LaneMask narrowed(const LaneMask& lanes, const LaneMask& to) {
  return lanes & to;
}

/// Lanes in step, or each lane at its own pace: whichever has come to the end of its period is controlled.
template <class Period>
void run_sampled(const LoopSetup& setup, const Dynamics<Lanes>& chain, const Period& period,
                 std::span<const LoopCase> cases, std::span<LoopResult> results,
                 LaneObserver<typename Period::Mask> observer) {
  using Mask = typename Period::Mask;
  const double period_s = setup.control.period_s();
  LaneDelay<Mask> delay(cases, period_s);
  LaneInput<Mask> input(chain, period_s);
  LaneResults seen(setup, cases.size());
  typename Period::Steps steps;
  PlantState<Lanes>& state = steps.state;
  std::array<double, lane_count> theta0;
  for (std::size_t i = 0; i < lane_count; ++i) theta0[i] = cases[std::min(i, cases.size() - 1)].theta0_rad;
  state.theta_rad = Lanes::load(theta0.data());
  const Lanes limit(setup.amplifier_limit_v), one(1.0);
  const Lanes periods(std::round(setup.duration_s * setup.control.sample_rate_hz));
  Lanes begun(0.0), command(0.0);
  for (bool first = true;;) {
    const Mask arrived = narrowed(Period::arrived(steps), begun <= periods);
    if (any(arrived)) {
      seen.take(arrived, begun * Lanes(period_s), state);
      begun = select(arrived, begun + one, begun);
      if (seen.all_fell() || !any(begun <= periods)) break;
      const Mask goes_on = narrowed(arrived, begun <= periods);
      const Outputs<Lanes> shown = chain.measure(state);
      const Lanes newest = first ? observer.start(shown) : observer.take(goes_on, shown, command);
      if (first) delay.start(newest);
      first = false;
      const Lanes wanted = observer.command_v(goes_on, delay.pass(goes_on, newest), command);
      command = select(goes_on, smaller(larger(wanted, -limit), limit), command);
      const LaneDrive drive = input.pass(goes_on, chain.actuate(command));
      if (!chain.has_motor_lag()) state.motor_v = drive.late_v;
      period.begin(steps, goes_on, drive);
    }
    period.advance(steps);
  }
  seen.finish(state, results);
}

/// Runs that fit the lanes, from number `first` on.
template <class Present>
void run_with(const LoopSetup& setup, const LaneParts& parts, const Present& present, std::size_t first,
              std::span<const LoopCase> cases, std::span<LoopResult> results) {
  const PlantModel<Lanes> model = on_lanes(setup.model);
  const Dynamics<Lanes> chain(model);
  if constexpr (may_stick<Present> || may_have_bristles<Present>) {
    // Encoder steps let the voltage jump, and the cart reverse, in most periods; so do predictors of long
    // delays.
    const bool jumps =
        setup.cart_resolution_m > 0.0 || setup.angle_resolution_rad > 0.0 || !parts.predictions.empty();
    const bool reverses = jumps && chain.cart_has_kink() && setup.model.smoothing == 0.0;
    if (chain.cart_can_stick() || chain.pivot_can_stick() || reverses)
      return run_sampled(setup, chain, EventPeriod<Present>(model, present), cases, results,
                         LaneObserver<LaneMask>(setup, parts, first, cases.size()));
  }
  run_sampled(setup, chain, SmoothPeriod<Present>(setup, model, present), cases, results,
              LaneObserver<EveryLane>(setup, parts, first, cases.size()));
}

}  // namespace

namespace UPRIGHT_LANES {

std::size_t runs_side_by_side() {
  return lane_count;
}

void run(const LoopSetup& setup, const LaneParts& parts, std::span<const LoopCase> cases,
         std::span<LoopResult> results) {
  if (!setup.sampled) return run_continuous_on_lanes(setup, cases, results);
  with_effects(setup.model.present, [&](const auto& present) {
    for (std::size_t first = 0; first < cases.size(); first += lane_count) {
      const std::size_t count = std::min(lane_count, cases.size() - first);
      run_with(setup, parts, present, first, cases.subspan(first, count), results.subspan(first, count));
    }
  });
}

}  // namespace UPRIGHT_LANES

}  // namespace upright
