#include "blind_case.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "design/gain_design.hpp"

namespace upright::blind {

namespace {

using Random = std::mt19937_64;

double between(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

bool chance(Random& random, double p) {
  return std::bernoulli_distribution(p)(random);
}

double either_sign(Random& random) {
  return chance(random, 0.5) ? 1.0 : -1.0;
}

template <std::size_t N>
double one_of(Random& random, const std::array<double, N>& values) {
  return values[std::uniform_int_distribution<std::size_t>(0, N - 1)(random)];
}

bool needs_pendulum(const std::string& kind) {
  return kind.starts_with("pivot_") || kind.starts_with("angle_") || kind.starts_with("pendulum_");
}

/// What a pendulum shows that swings from a cart held still.
bool shows_when_locked(const std::string& kind) {
  return kind.starts_with("pivot_") || kind == "angle_scale" || kind == "pendulum_length";
}

bool needs_dry_level(const std::string& kind) {
  return kind == "bristle_friction" || kind == "position_dependent_friction" ||
         kind == "friction_asymmetry" || kind == "stribeck_friction" || kind == "warming_friction";
}

/// The laboratory cart of the paper, every number up to about a third larger or smaller.
Plant random_plant(Random& random, bool pendulum) {
  const auto scaled = [&](double value) { return value * std::exp(between(random, -0.3, 0.3)); };
  Plant plant;
  plant.cart_mass_kg = scaled(0.815);
  if (pendulum) plant.pendulum = Pendulum{scaled(0.21), scaled(0.305), {}};
  plant.gravity_mps2 = 9.81;
  plant.motor = {scaled(1.7189), scaled(7.682)};
  plant.set("viscous_friction", {scaled(3.0)});
  return plant;
}

double damping_of(const Plant& plant) {
  const PlantEffect* viscous = plant.find("viscous_friction");
  return plant.motor.back_emf_n_per_mps + (viscous != nullptr ? viscous->values[0] : 0.0);
}

double time_constant_s(const Plant& plant) {
  return (plant.cart_mass_kg + (plant.pendulum ? plant.pendulum->mass_kg : 0.0)) / damping_of(plant);
}

/// What moves in the runs of the believed plant: root mean square of the liveliest run.
struct Scales {
  double force_n = 0.0, volts = 0.0, high_volts = 0.0;
  double speed_mps = 0.0, travel_m = 0.0, center_m = 0.0;
  double gravity_torque_nm = 0.0, rate_radps = 0.0;
};

double slope_rms(const Measurement& run, const std::vector<double>& values) {
  if (values.empty()) return 0.0;
  const auto step = static_cast<std::size_t>(std::max(1.0, std::ceil(0.02 / run.median_period_s())));
  double sum = 0.0, count = 0.0;
  for (std::size_t k = step; k < values.size(); k += step) {
    sum += std::pow((values[k] - values[k - step]) / (run.time_s[k] - run.time_s[k - step]), 2);
    count += 1.0;
  }
  return std::sqrt(sum / std::max(count, 1.0));
}

Scales scales_of(const Plant& plant, const std::vector<Measurement>& runs) {
  Scales s;
  for (const Measurement& run : runs) {
    double volts = 0.0, torque = 0.0;
    std::vector<double> sizes;
    for (const double v : run.voltage_v) {
      volts += v * v;
      sizes.push_back(std::abs(v));
    }
    const auto n = static_cast<double>(run.size());
    s.volts = std::max(s.volts, std::sqrt(volts / n));
    std::sort(sizes.begin(), sizes.end());
    s.high_volts = std::max(s.high_volts, sizes[sizes.size() * 98 / 100]);
    s.speed_mps = std::max(s.speed_mps, slope_rms(run, run.cart_m));
    s.rate_radps = std::max(s.rate_radps, slope_rms(run, run.theta_rad));
    if (run.has_cart()) {
      const auto [low, high] = std::minmax_element(run.cart_m.begin(), run.cart_m.end());
      if (*high - *low > s.travel_m) s.center_m = 0.5 * (*high + *low);
      s.travel_m = std::max(s.travel_m, *high - *low);
    }
    if (!plant.pendulum) continue;
    for (const double theta : run.theta_rad) torque += std::pow(std::sin(theta), 2);
    s.gravity_torque_nm =
        std::max(s.gravity_torque_nm, plant.pendulum->mass_kg * plant.gravity_mps2 *
                                          plant.pendulum->length_to_com_m * std::sqrt(torque / n));
  }
  s.force_n = plant.motor.force_per_volt_n * s.volts;
  return s;
}

double pick(Size size, double weak, double typical, double strong) {
  return size == Size::weak ? weak : size == Size::typical ? typical : strong;
}

/// The parameters of a hidden effect, in their declared order.
std::vector<double> values_for(const std::string& kind, Size size, const Plant& plant, const Scales& s,
                               Random& random) {
  const double share = pick(size, 0.03, 0.10, 0.25) * between(random, 0.8, 1.25);
  const double pivot_share = pick(size, 0.01, 0.03, 0.10) * between(random, 0.8, 1.25);
  const double force = share * s.force_n, torque = pivot_share * s.gravity_torque_nm;
  const double sign = either_sign(random);
  if (kind == "viscous_friction") return {force / s.speed_mps};
  if (kind == "coulomb_friction") return {force};
  if (kind == "friction_asymmetry" || kind == "constant_force") return {sign * force};
  if (kind == "viscous_asymmetry") return {sign * force / s.speed_mps};
  if (kind == "stribeck_friction")
    return {2.0 * force, s.speed_mps * between(random, 0.1, 0.4), chance(random, 0.5) ? 2.0 : 1.0};
  if (kind == "position_dependent_friction") return {sign * force / (0.5 * s.travel_m)};
  if (kind == "bristle_friction") {
    // Deflection at breakaway as a share of the travel; half of critical damping.
    const double deflection_m = pick(size, 0.0005, 0.002, 0.008) * s.travel_m;
    const double stiffness = plant.find("coulomb_friction")->values[0] / deflection_m;
    return {stiffness, std::sqrt(stiffness * plant.cart_mass_kg)};
  }
  if (kind == "quadratic_drag") return {force / (s.speed_mps * s.speed_mps)};
  if (kind == "cable_spring")
    return {force / (0.3 * s.travel_m), s.center_m + between(random, -0.3, 0.3) * s.travel_m};
  if (kind == "cogging_force")
    return {force, s.travel_m / between(random, 4.0, 15.0), between(random, -3.0, 3.0)};
  if (kind == "drive_compliance") return {pick(size, 0.0002, 0.0006, 0.002) * s.travel_m / s.force_n};
  if (kind == "voltage_saturation") return {s.high_volts * pick(size, 0.85, 0.65, 0.45)};
  if (kind == "voltage_dead_zone") return {share * s.volts};
  if (kind == "voltage_gain") return {1.0 + sign * share};
  if (kind == "voltage_offset") return {sign * share * s.volts};
  if (kind == "input_delay" || kind == "motor_lag") return {share * time_constant_s(plant)};
  if (kind == "pivot_viscous_friction") return {torque / s.rate_radps};
  if (kind == "pivot_coulomb_friction") return {torque};
  if (kind == "pivot_quadratic_drag") return {torque / (s.rate_radps * s.rate_radps)};
  if (kind == "angle_offset") return {sign * pick(size, 0.005, 0.015, 0.05)};
  if (kind == "angle_scale") return {1.0 + sign * pick(size, 0.005, 0.02, 0.06)};
  // cart_scale and the base parameters.
  return {1.0 + sign * pick(size, 0.06, 0.12, 0.25) * between(random, 0.9, 1.1)};
}

/// What is hidden is the whole difference: a base parameter that is hidden is not off by a few percent as
/// well, and of the two that are the same force (-c v) the other one is right.
void keep_as_believed(const Request& request, const Plant& believed, Plant& truth) {
  for (const std::string& kind : request.hidden) {
    if (kind == "cart_mass") truth.cart_mass_kg = believed.cart_mass_kg;
    if (kind == "pendulum_mass") truth.pendulum->mass_kg = believed.pendulum->mass_kg;
    if (kind == "pendulum_length") truth.pendulum->length_to_com_m = believed.pendulum->length_to_com_m;
    if (kind == "back_emf" || kind == "viscous_friction")
      truth.motor.back_emf_n_per_mps = believed.motor.back_emf_n_per_mps;
    if (kind == "back_emf")
      truth.set(effect_number("viscous_friction"), believed.find("viscous_friction")->values);
  }
}

std::string choose_campaign(const Request& request, double rate_hz, Random& random) {
  const auto& kinds = request.hidden;
  const bool pendulum = std::any_of(kinds.begin(), kinds.end(), needs_pendulum);
  const double u = between(random, 0.0, 1.0);
  if (std::all_of(kinds.begin(), kinds.end(), shows_when_locked) && u < 0.3) return "locked";
  const double v = between(random, 0.0, 1.0);
  if (v < 0.15 && rate_hz >= 200.0) return "upright";
  if (v < 0.35 && !pendulum) return "cart_alone";
  if (v < 0.6) return "hanging";
  return "mixed";
}

Experiment choose_experiment(const std::string& campaign, double rate_hz, int run, int runs, Random& random) {
  if (campaign == "locked") return Experiment::locked_swing;
  if (campaign == "upright") return Experiment::balance;
  if (campaign == "mixed" && rate_hz >= 200.0 && (run == 1 || (run > 1 && chance(random, 0.25))))
    return Experiment::balance;
  if (campaign == "mixed" && run > 2 && runs > 3 && chance(random, 0.3)) return Experiment::locked_swing;
  if (run == 0) return chance(random, 0.6) ? Experiment::multisine : Experiment::square;
  const std::array open = {Experiment::multisine, Experiment::square, Experiment::constant,
                           Experiment::coast};
  return open[std::uniform_int_distribution<std::size_t>(0, 3)(random)];
}

std::vector<Plan> choose_plans(const Request& request, const std::string& campaign, double rate_hz,
                               const Plant& believed, Random& random) {
  int runs = request.runs > 0 ? request.runs : std::uniform_int_distribution<int>(1, 6)(random);
  const double total_s = request.most_samples / rate_hz;
  runs = std::max(1, std::min(runs, static_cast<int>(total_s / 4.0)));
  const double volts_per_mps = damping_of(believed) / believed.motor.force_per_volt_n;
  std::array<double, 4> gains{};
  if (believed.pendulum) gains = design_gains(believed, {}, 100.0).gains;
  std::vector<Plan> plans;
  for (int r = 0; r < runs; ++r) {
    Plan plan;
    plan.experiment = choose_experiment(campaign, rate_hz, r, runs, random);
    plan.rate_hz = rate_hz;
    plan.duration_s = std::min(between(random, 5.0, 12.0), total_s / runs);
    if (request.duration_s > 0.0) plan.duration_s = request.duration_s;
    plan.amplitude_v = between(random, 0.2, 0.5) * volts_per_mps;
    plan.centring_v_per_m = 1.2 * volts_per_mps;
    plan.gains = gains;
    plan.loop_delay_s = chance(random, 0.5) ? between(random, 0.0, 0.01) : 0.0;
    plan.swing_rad = either_sign(random) * between(random, 0.1, 0.8);
    if (plan.experiment == Experiment::coast)
      plan.swing_rad = either_sign(random) * between(random, 0.5, 1.5);
    if (plan.experiment == Experiment::locked_swing)
      plan.swing_rad = either_sign(random) * between(random, 0.4, 2.0);
    if (plan.experiment == Experiment::balance) {
      plan.swing_rad = either_sign(random) * between(random, 0.0, 0.05);
      if (chance(random, 0.2)) plan.let_go_s = between(random, 0.4, 0.8) * plan.duration_s;
    }
    if (chance(random, 0.2))
      plan.gaps_s.emplace_back(between(random, 0.2, 0.8) * plan.duration_s, between(random, 0.05, 0.4));
    plan.seed = random();
    plans.push_back(plan);
  }
  return plans;
}

}  // namespace

std::string_view name_of(Size size) {
  return size == Size::weak ? "weak" : size == Size::typical ? "typical" : "strong";
}

const std::vector<std::string>& unknown_kinds() {
  static const std::vector<std::string> kinds = {"backlash", "warming_friction", "gusts"};
  return kinds;
}

std::vector<std::string> random_pair(std::uint64_t seed) {
  static const std::vector<std::string> kinds = {"coulomb_friction",
                                                 "viscous_asymmetry",
                                                 "stribeck_friction",
                                                 "quadratic_drag",
                                                 "constant_force",
                                                 "cable_spring",
                                                 "cogging_force",
                                                 "voltage_saturation",
                                                 "voltage_dead_zone",
                                                 "input_delay",
                                                 "motor_lag",
                                                 "pivot_viscous_friction",
                                                 "pivot_coulomb_friction",
                                                 "pivot_quadratic_drag",
                                                 "position_dependent_friction",
                                                 "cart_scale"};
  Random random(seed * 31 + 5);
  std::uniform_int_distribution<std::size_t> any(0, kinds.size() - 1);
  const std::size_t first = any(random);
  std::size_t second = any(random);
  while (second == first) second = any(random);
  return {kinds[first], kinds[second]};
}

Case make_case(const Request& request) {
  Random random(request.seed);
  Case blind;
  blind.request = request;
  double rate_hz = one_of(random, std::array{100.0, 200.0, 250.0, 500.0, 500.0, 1000.0, 2000.0});
  constexpr double least_seconds = 6.0;
  if (request.rate_hz > 0.0) rate_hz = request.rate_hz;
  while (request.most_samples / rate_hz < least_seconds) rate_hz *= 0.5;
  blind.campaign = choose_campaign(request, rate_hz, random);
  blind.believed = random_plant(random, blind.campaign != "cart_alone");
  blind.plans = choose_plans(request, blind.campaign, rate_hz, blind.believed, random);

  const auto hides = [&](std::string_view kind) {
    return std::find(request.hidden.begin(), request.hidden.end(), kind) != request.hidden.end();
  };
  std::vector<Measurement> rehearsal;
  for (std::size_t r = 0; r < blind.plans.size(); ++r)
    rehearsal.push_back(measure({.plant = blind.believed}, blind.plans[r], "rehearsal"));
  const Scales scales = scales_of(blind.believed, rehearsal);

  if (hides("viscous_friction")) blind.believed.remove(effect_number("viscous_friction"));
  const bool dry = std::any_of(request.hidden.begin(), request.hidden.end(), needs_dry_level);
  const bool cart = blind.campaign != "locked";
  const double known_dry = hides("bristle_friction")   ? 1.0
                           : hides("coulomb_friction") ? 0.0
                           : dry                       ? 0.6
                                                       : 0.25;
  if (cart && chance(random, known_dry))
    blind.believed.set("coulomb_friction", {between(random, 0.07, 0.15) * scales.force_n});

  Plant truth = blind.believed;
  const auto nearly = [&](double& value) { value *= between(random, 0.97, 1.03); };
  nearly(truth.cart_mass_kg);
  nearly(truth.motor.back_emf_n_per_mps);
  if (truth.pendulum) {
    nearly(truth.pendulum->mass_kg);
    nearly(truth.pendulum->length_to_com_m);
  }
  for (PlantEffect& effect : truth.effects) nearly(effect.values[0]);
  keep_as_believed(request, blind.believed, truth);

  blind.rig.cart_step_m = one_of(random, std::array{1e-5, 2.27485e-5, 5e-5});
  blind.rig.theta_step_rad =
      2.0 * std::numbers::pi / one_of(random, std::array{4096.0, 4096.0, 8192.0, 2400.0});
  blind.rig.actual_times = chance(random, 0.5);
  if (request.disturbed) {
    blind.rig.disturbance_n = 0.05;
    blind.rig.jitter_s = between(random, 20e-6, 150e-6);
  }
  for (const std::string& kind : request.hidden) {
    const double share = pick(request.size, 0.03, 0.10, 0.25);
    if (kind == "backlash") {
      blind.rig.unknown = Unknown::backlash;
      blind.rig.backlash_m = pick(request.size, 0.002, 0.006, 0.02) * scales.travel_m;
    } else if (kind == "warming_friction") {
      blind.rig.unknown = Unknown::warming_friction;
      blind.rig.warming_force_n = 1.5 * share * scales.force_n;
      blind.rig.warming_time_s = between(random, 2.0, 6.0);
    } else if (kind == "gusts") {
      blind.rig.unknown = Unknown::gusts;
      blind.rig.gust_force_n = 2.0 * share * scales.force_n;
    } else {
      const std::size_t effect = effect_number(kind);
      blind.hidden.push_back({effect, values_for(kind, request.size, blind.believed, scales, random)});
      truth.set(effect, blind.hidden.back().values);
    }
  }
  blind.rig.plant = truth;
  return blind;
}

std::vector<Measurement> measure_all(const Case& blind, bool without_unknown) {
  Rig rig = blind.rig;
  if (without_unknown) rig.unknown = Unknown::none;
  std::vector<Measurement> runs;
  for (std::size_t r = 0; r < blind.plans.size(); ++r)
    runs.push_back(measure(rig, blind.plans[r], "run" + std::to_string(r)));
  return runs;
}

}  // namespace upright::blind
