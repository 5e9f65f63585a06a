#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "control/kalman_filter.hpp"
#include "fast_loop.hpp"
#include "lane_builds.hpp"

namespace upright {

namespace {

/// One compilation of the lanes.
struct LaneBuild {
  std::size_t (*runs_side_by_side)();
  void (*run)(const LoopSetup& setup, const LaneParts& parts, std::span<const PlantModel<double>> plants,
              LoopSource& source);
};

constexpr LaneBuild baseline{baseline_lanes::runs_side_by_side, baseline_lanes::run};

#ifdef UPRIGHT_DISPATCH
/// What the compiler may use with -march=x86-64-v3, as far as the lanes do.
bool has_avx2() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
         __builtin_cpu_supports("bmi2");
}

/// The same with -march=x86-64-v4.
bool has_avx512() {
  return has_avx2() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl");
}

/// The lanes for this processor. UPRIGHT_LANES chooses narrower ones: baseline or avx2.
LaneBuild widest() {
  const char* text = std::getenv("UPRIGHT_LANES");  // NOLINT(concurrency-mt-unsafe): nothing sets it
  const std::string_view widest = text != nullptr ? text : "avx512";
  if (widest == "baseline" || !has_avx2()) return baseline;
  if (widest == "avx2" || !has_avx512()) return {avx2_lanes::runs_side_by_side, avx2_lanes::run};
  return {avx512_lanes::runs_side_by_side, avx512_lanes::run};
}
#else
LaneBuild widest() {
  return {wide_lanes::runs_side_by_side, wide_lanes::run};
}
#endif

/// The greatest rate of a plant's motion at realistic speeds [1/s].
double fastest_rate_radps(const PlantModel<double>& model, bool bristles) {
  const Dynamics<double> physics(model);
  double fastest = 0.0;
  for (const double speed : {0.0, 0.01, 0.1, 1.0}) {
    PlantState<double> state;
    state.cart_mps = speed;
    fastest = std::max(fastest, physics.fastest_rate_radps(state, bristles));
  }
  return fastest;
}

/// Faster plants than that need steps that the lanes do not take in general.
constexpr double fastest_radps = 1e3;

/// Whether bristles, and nothing else, are too fast for the steps of a period. Their relaxation may be as
/// fast as it will. Steps resolve the motion of a resting cart on them, which must leave a bounded number of
/// steps to a millisecond (50).
bool has_stiff_bristles(const PlantModel<double>& model) {
  constexpr double fastest_at_rest_radps = 1e4;
  const Dynamics<double> physics(model);
  if (!physics.has_bristle_state() || fastest_rate_radps(model, true) < fastest_radps) return false;
  const double push = 1.0 / physics.min_cart_inertia();
  return fastest_rate_radps(model, false) < fastest_radps &&
         std::sqrt(physics.bristle_stiffness() * push) + physics.bristle_damping() * push <
             fastest_at_rest_radps;
}

/// Where the smoothed friction of the pivot is larger, sampled loops amplify the errors of lanes near rest:
/// the largest of 240 runs is 4.0e-7 m at this and 1.8e-6 m at 80 mN m. Halved steps leave 1.0e-6 m there.
/// Continuous loops have 2.0e-6 rad at 10 mN m.
constexpr double largest_smoothed_pivot_nm = 0.05;

/// Longer periods are for the classical method, which samples what a series would extrapolate.
constexpr double longest_series_s = 1.0001e-3;

const LaneBuild& lanes_for(LaneRegisters registers) {
  static const LaneBuild wide = widest();
  return registers == LaneRegisters::wide ? wide : baseline;
}

/// Whether the motion of a sliding cart is analytic in time, as far as its effects say that.
bool has_short_series(const PlantModel<double>& model) {
  bool all = true;
  for_each_effect([&]<std::size_t I>() {
    using E = EffectAt<I>;
    if constexpr (requires { E::has_short_series(model.of<I>()); })
      if (model.present.has<I>()) all = all && E::has_short_series(model.of<I>());
  });
  return all;
}

bool compensates(const LoopSetup& setup) {
  return setup.make_parts && setup.control.compensation.kind != CompensationKind::none;
}

std::optional<LaneEstimator> estimator_of(const LoopSetup& setup) {
  if (!setup.make_parts || !setup.control.has_state_estimator()) return {};
  const ModelParts parts = setup.make_parts(setup.control);
  const auto& filter = dynamic_cast<const KalmanFilter&>(*parts.estimator);
  return LaneEstimator{filter.step(), filter.model()};
}

/// What does not depend on the plants. `predictions` must outlive it.
LaneParts parts_of_controller(const LoopSetup& setup, LanePredictions& predictions) {
  LaneParts parts;
  parts.estimator = estimator_of(setup);
  if (compensates(setup)) parts.predictions = &predictions;
  return parts;
}

/// Sets how lanes run this plant.
void choose_steps(const LoopSetup& setup, const PlantModel<double>& model, LaneParts& parts) {
  LoopSetup of_plant = setup;
  of_plant.model = model;
  parts.own_pace = lanes_refill(of_plant);
  const Dynamics<double> physics(model);
  parts.pivot_or_lag = parts.own_pace && (physics.pivot_can_stick() || physics.has_motor_lag());
  parts.stiff_bristles = setup.sampled && has_stiff_bristles(model);
  // At slower rates, periods are longer than a millisecond.
  parts.short_series = has_short_series(model) && setup.control.period_s() <= longest_series_s;
}

/// Runs of several plants from several starts, numbered by plant and then by start.
class ListedRuns final : public LoopSource {
 public:
  ListedRuns(std::size_t plants, std::span<const LoopCase> cases, std::span<LoopResult> results)
      : plants_(plants), cases_(cases), results_(results) {}

  bool next(LoopRun& run) override {
    if (next_ == plants_ * cases_.size()) return false;
    run = {next_, cases_[next_ % cases_.size()], next_ / cases_.size()};
    ++next_;
    return true;
  }
  void take(std::size_t number, const LoopResult& result) override { results_[number] = result; }
  double longest_delay_s() const override {
    return std::max_element(cases_.begin(), cases_.end(),
                            [](const LoopCase& a, const LoopCase& b) { return a.delay_s < b.delay_s; })
        ->delay_s;
  }

 private:
  std::size_t plants_;
  std::span<const LoopCase> cases_;
  std::span<LoopResult> results_;
  std::size_t next_ = 0;
};

/// Whether lanes may have these two plants at once. The input delay is the same in all lanes, and some
/// effects treat parameters that are whole numbers (an exponent of 2, the kind of a table) specially, if all
/// lanes have them. The effects, which all plants share, and the smoothing say whether a motor lags and a
/// contact sticks; by lane are the constant of the lag and the levels of the friction.
bool may_mix(const PlantModel<double>& one, const PlantModel<double>& other) {
  if (one.smoothing != other.smoothing ||
      Dynamics<double>(one).input_delay_s() != Dynamics<double>(other).input_delay_s() ||
      has_stiff_bristles(one) != has_stiff_bristles(other) ||
      has_short_series(one) != has_short_series(other))
    return false;
  const auto is_whole = [](double number) { return number == std::round(number); };
  for (std::size_t i = 0; i < all_parameter_count; ++i) {
    const double a = one.parameters[i], b = other.parameters[i];
    if (a != b && (is_whole(a) || is_whole(b))) return false;
  }
  return true;
}

}  // namespace

bool lanes_can_run(const LoopSetup& setup) {
  if (setup.make_parts &&
      (!setup.sampled || setup.control.state_estimator.kind == StateEstimatorKind::extended_kalman))
    return false;
  if (setup.model.cart_locked || !setup.model.has_pendulum) return false;
  const Dynamics<double> physics(setup.model);
  if (physics.changes_with_time() || physics.depends_on_load() || physics.has_attached_mass() ||
      physics.loses_counts())
    return false;
  const double pivot_nm = physics.pivot_dry_level();
  if (!setup.sampled && (physics.has_motor_lag() || pivot_nm > 0.0)) return false;
  if (setup.model.smoothing > 0.0 && pivot_nm > largest_smoothed_pivot_nm) return false;
  // A step towards a stop would not show a shorter one.
  constexpr double shortest_lag_s = 1e-4;
  if (physics.has_motor_lag() && physics.motor_time_constant_s() < shortest_lag_s) return false;
  if (fastest_rate_radps(setup.model, true) < fastest_radps) return true;
  // The exponential steps of stiff bristles need a held voltage, and an acceleration without jumps.
  return setup.sampled && has_stiff_bristles(setup.model) && !physics.has_motor_lag() &&
         !physics.pivot_has_kink();
}

std::size_t runs_side_by_side(LaneRegisters registers) {
  return lanes_for(registers).runs_side_by_side();
}

bool lanes_refill(const LoopSetup& setup) {
  if (!setup.sampled || has_stiff_bristles(setup.model)) return true;
  const Dynamics<double> physics(setup.model);
  // Encoder steps let the voltage jump, and the cart reverse, in most periods; so do predictors of long
  // delays.
  const bool jumps = setup.cart_resolution_m > 0.0 || setup.angle_resolution_rad > 0.0 ||
                     setup.control.compensation.kind != CompensationKind::none;
  const bool reverses = jumps && physics.cart_has_kink() && setup.model.smoothing == 0.0;
  return physics.cart_can_stick() || physics.pivot_can_stick() || reverses;
}

void run_on_lanes(const LoopSetup& setup, std::span<const LoopCase> cases, std::span<LoopResult> results,
                  LaneRegisters registers) {
  run_plants_on_lanes(setup, std::span(&setup.model, 1), cases, results, registers);
}

void run_plants_on_lanes(const LoopSetup& setup, std::span<const PlantModel<double>> plants,
                         std::span<const LoopCase> cases, std::span<LoopResult> results,
                         LaneRegisters registers) {
  if (cases.empty()) return;
  LanePredictions predictions(setup);
  LaneParts parts = parts_of_controller(setup, predictions);
  for (std::size_t first = 0, end = 0; first < plants.size(); first = end) {
    choose_steps(setup, plants[first], parts);
    const bool mix = setup.sampled && parts.own_pace;
    for (end = first + 1; mix && end < plants.size() && may_mix(plants[first], plants[end]);) ++end;
    const std::size_t count = end - first;
    ListedRuns runs(count, cases, results.subspan(first * cases.size(), count * cases.size()));
    lanes_for(registers).run(setup, parts, plants.subspan(first, count), runs);
  }
}

void run_source_on_lanes(const LoopSetup& setup, LoopSource& source, LaneRegisters registers) {
  LanePredictions predictions(setup);
  LaneParts parts = parts_of_controller(setup, predictions);
  choose_steps(setup, setup.model, parts);
  lanes_for(registers).run(setup, parts, std::span(&setup.model, 1), source);
}

LoopSource::~LoopSource() = default;

}  // namespace upright
