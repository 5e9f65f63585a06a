#include <algorithm>
#include <bit>
#include <optional>
#include <vector>

#include "continuous_lanes.hpp"
#include "event_period.hpp"
#include "lane_builds.hpp"
#include "lane_model.hpp"
#include "lane_observer.hpp"
#include "lane_results.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/sim/runge_kutta.hpp"

namespace upright {

namespace {

/// Feedback voltages on their way, one ring for all lanes. The feedback is linear, so that delaying the
/// voltage is delaying the state.
class LaneDelay {
 public:
  LaneDelay(std::span<const LoopCase> cases, double period_s) {
    std::size_t longest = 0;
    std::array<double, lane_count> fraction{};
    for (std::size_t i = 0; i < lane_count; ++i) {
      const DelayLine line(cases[std::min(i, cases.size() - 1)].delay_s, period_s);
      whole_[i] = line.whole_periods();
      fraction[i] = line.fraction();
      longest = std::max(longest, whole_[i]);
      same_ = same_ && whole_[i] == whole_[0];
      exact_ = exact_ && line.exact();
    }
    fraction_ = Lanes::load(fraction.data());
    ring_.resize(std::bit_ceil(longest + 2) * lane_count);
  }

  void start(const Lanes& volts) {
    for (std::size_t i = 0; i < ring_.size(); i += lane_count) volts.store(&ring_[i]);
  }

  Lanes pass(std::size_t tick, const Lanes& volts) {
    volts.store(&ring_[slot(tick)]);
    const Lanes later = back(tick, 0);
    if (exact_) return later;
    return later + fraction_ * (back(tick, 1) - later);
  }

 private:
  std::size_t slot(std::size_t tick) const { return tick * lane_count & (ring_.size() - 1); }

  Lanes back(std::size_t tick, std::size_t more) const {
    if (same_) return Lanes::load(&ring_[slot(tick - whole_[0] - more)]);
    std::array<double, lane_count> volts;
    for (std::size_t i = 0; i < lane_count; ++i) volts[i] = ring_[slot(tick - whole_[i] - more) + i];
    return Lanes::load(volts.data());
  }

  std::array<std::size_t, lane_count> whole_{};
  Lanes fraction_;
  std::vector<double> ring_;
  bool same_ = true, exact_ = true;
};

/// How the motion gets through one period with the voltage held: smooth friction.
template <class Present>
class SmoothPeriod {
 public:
  SmoothPeriod(const LoopSetup& setup, const PlantModel<Lanes>& model, const Present& present)
      : physics_(model, present) {
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

  [[gnu::flatten]] void advance(PlantState<Lanes>& state, const Lanes& motor_v, double period_s) {
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
  double turning_mps_ = 0.0, sweep_mps_ = 0.0;
};

template <class Period>
void run_sampled(const LoopSetup& setup, const Dynamics<Lanes>& chain, Period& period, LaneObserver& observer,
                 std::span<const LoopCase> cases, std::span<LoopResult> results) {
  const double period_s = setup.control.period_s();
  LaneDelay delay(cases, period_s);
  LaneResults seen(setup, cases.size());
  PlantState<Lanes> state{};
  std::array<double, lane_count> theta0;
  for (std::size_t i = 0; i < lane_count; ++i) theta0[i] = cases[std::min(i, cases.size() - 1)].theta0_rad;
  state.theta_rad = Lanes::load(theta0.data());
  const Lanes limit(setup.amplifier_limit_v);
  Lanes feedback(0.0), command(0.0);
  const auto ticks = static_cast<std::size_t>(std::llround(setup.duration_s * setup.control.sample_rate_hz));
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    seen.take(static_cast<double>(tick) * period_s, state);
    if (seen.all_fell()) break;
    const Outputs<Lanes> shown = chain.measure(state);
    if (tick == 0) {
      feedback = observer.start(shown);
      delay.start(feedback);
    } else {
      feedback = observer.take(shown, command);
    }
    command = smaller(larger(observer.command_v(delay.pass(tick, feedback)), -limit), limit);
    state.motor_v = chain.actuate(command);
    period.advance(state, state.motor_v, period_s);
  }
  seen.take(static_cast<double>(ticks) * period_s, state);
  seen.finish(state, results);
}

template <class Present>
void run_with(const LoopSetup& setup, const LaneEstimator* estimator, const Present& present,
              std::span<const LoopCase> cases, std::span<LoopResult> results) {
  LaneObserver observer(setup, estimator);
  const PlantModel<Lanes> model = on_lanes(setup.model);
  const Dynamics<Lanes> chain(model);
  if constexpr (may_stick<Present>) {
    if (chain.cart_can_stick()) {
      EventPeriod<Present> period(model, present);
      return run_sampled(setup, chain, period, observer, cases, results);
    }
  }
  SmoothPeriod<Present> period(setup, model, present);
  run_sampled(setup, chain, period, observer, cases, results);
}

}  // namespace

namespace UPRIGHT_LANES {

std::size_t runs_side_by_side() {
  return lane_count;
}

void run(const LoopSetup& setup, const LaneEstimator* estimator, std::span<const LoopCase> cases,
         std::span<LoopResult> results) {
  if (!setup.sampled) return run_continuous_on_lanes(setup, cases, results);
  with_effects(setup.model.present, [&](const auto& present) {
    for (std::size_t first = 0; first < cases.size(); first += lane_count) {
      const std::size_t count = std::min(lane_count, cases.size() - first);
      run_with(setup, estimator, present, cases.subspan(first, count), results.subspan(first, count));
    }
  });
}

}  // namespace UPRIGHT_LANES

}  // namespace upright
