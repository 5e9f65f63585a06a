#include "blind_case.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "design/gain_design.hpp"
#include "laboratory.hpp"
#include "upright/base/error.hpp"

namespace upright::blind {

namespace {

/// What a pendulum shows that swings from a cart held still.
bool shows_when_locked(const std::string& kind) {
  return kind.starts_with("pivot_") || kind == "angle_scale" || kind == "pendulum_length" ||
         kind == "flexible_rod";
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

std::vector<Plan> choose_plans(const Request& request, const std::string& campaign, double rate_hz,
                               const Plant& believed, Random& random) {
  int runs = request.runs > 0 ? request.runs : std::uniform_int_distribution<int>(1, 6)(random);
  const double total_s = request.max_samples / rate_hz;
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

void hide_unknown(const std::string& kind, Size size, const Scales& scales, Rig& rig, Random& random) {
  const double share = pick(size, 0.03, 0.10, 0.25), force_n = share * scales.force_n;
  if (kind == "encoder_play") {
    rig.unknown = Unknown::encoder_play;
    rig.play_m = pick(size, 0.002, 0.006, 0.02) * scales.travel_m;
  } else if (kind == "gusts") {
    rig.unknown = Unknown::gusts;
    rig.gust_force_n = 2.0 * force_n;
  } else if (kind == "rough_track") {
    rig.unknown = Unknown::rough_track;
    rig.unknown_size = force_n;
    rig.unknown_period = scales.travel_m * between_by_ratio(random, 0.01, 0.05);
    rig.rough_n = 0.0;
  } else if (kind == "velocity_ripple") {
    rig.unknown = Unknown::velocity_ripple;
    rig.unknown_size = force_n;
    rig.unknown_period = scales.speed_mps * between(random, 0.4, 1.0);
  } else if (kind == "force_drift") {
    rig.unknown = Unknown::force_drift;
    rig.unknown_size = 1.5 * force_n;
  } else {
    throw ConfigError("a case cannot hide " + kind + ": give a kind of the registry or of " +
                      "unknown_kinds()");
  }
}

}  // namespace

std::string_view name_of(Condition condition) {
  switch (condition) {
    case Condition::quantized:
      return "quantized";
    case Condition::disturbed:
      return "disturbed";
    case Condition::laboratory:
      return "laboratory";
  }
  return "";
}

namespace {

/// Whether a diagnosis can name it: an effect of the registry that has a size here. Some are hidden only
/// where a case asks for them, so that older seeds still make the same cases.
bool is_known(const std::string& kind) {
  const auto& drawn = hidden_kinds();
  const bool on_request = attaches_mass(effect_number(kind)) || kind == "lost_counts";
  return on_request || std::find(drawn.begin(), drawn.end(), kind) != drawn.end();
}

}  // namespace

std::vector<std::string> unknown_kinds(Condition condition) {
  if (condition != Condition::laboratory) return {"encoder_play", "gusts"};
  std::vector<std::string> kinds;
  for (const Unknown unknown : {Unknown::encoder_play, Unknown::gusts, Unknown::rough_track,
                                Unknown::velocity_ripple, Unknown::force_drift}) {
    const std::string kind(name_of(unknown));
    if (!is_known(kind)) kinds.push_back(kind);
  }
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

std::string choose_campaign(const Request& request, double rate_hz, Random& random) {
  const auto& kinds = request.hidden;
  const bool pendulum = std::any_of(kinds.begin(), kinds.end(), [](const std::string& kind) {
    const std::size_t effect = effect_number(kind);  // what is unknown has no number
    return effect < effect_count && needs_pendulum(effect);
  });
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

double chance_of_known_dry_friction(const Request& request, double otherwise) {
  const auto& kinds = request.hidden;
  const auto hides = [&](const char* kind) {
    return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
  };
  if (hides("bristle_friction")) return 1.0;
  if (hides("coulomb_friction")) return 0.0;
  return std::any_of(kinds.begin(), kinds.end(), needs_dry_level) ? 0.6 : otherwise;
}

Plant nearly_as_believed(const Case& blind, double off, Random& random) {
  Plant truth = blind.believed;
  const auto nearly = [&](double& value) { value *= between(random, 1.0 - off, 1.0 + off); };
  nearly(truth.cart_mass_kg);
  nearly(truth.motor.back_emf_n_per_mps);
  if (truth.pendulum) {
    nearly(truth.pendulum->mass_kg);
    nearly(truth.pendulum->length_to_com_m);
  }
  for (PlantEffect& effect : truth.effects) nearly(effect.values[0]);
  keep_as_believed(blind.request, blind.believed, truth);
  return truth;
}

void hide_effects(Case& blind, const Scales& scales, Plant& truth, Random& random) {
  for (const std::string& kind : blind.request.hidden) {
    if (!is_known(kind)) {
      hide_unknown(kind, blind.request.size, scales, blind.rig, random);
      continue;
    }
    const std::size_t effect = effect_number(kind);
    blind.hidden.push_back({effect, values_for(kind, blind.request.size, blind.believed, scales, random)});
    truth.set(effect, blind.hidden.back().values);
  }
}

Scales rehearse(const Case& blind) {
  std::vector<Measurement> runs;
  for (const Plan& plan : blind.plans) runs.push_back(measure({.plant = blind.believed}, plan, "rehearsal"));
  return scales_of(blind.believed, runs);
}

Request laboratory_request(std::uint64_t seed, std::vector<std::string> hidden) {
  Request request;
  request.hidden = std::move(hidden);
  request.seed = seed;
  request.condition = Condition::laboratory;
  return request;
}

Case make_case(const Request& request) {
  if (request.condition == Condition::laboratory) return make_laboratory_case(request);
  Random random(request.seed);
  Case blind;
  blind.request = request;
  double rate_hz = one_of(random, std::array{100.0, 200.0, 250.0, 500.0, 500.0, 1000.0, 2000.0});
  constexpr double min_seconds = 6.0;
  if (request.rate_hz > 0.0) rate_hz = request.rate_hz;
  while (request.max_samples / rate_hz < min_seconds) rate_hz *= 0.5;
  blind.campaign = choose_campaign(request, rate_hz, random);
  blind.believed = random_plant(random, blind.campaign != "cart_alone");
  blind.plans = choose_plans(request, blind.campaign, rate_hz, blind.believed, random);

  const auto hides = [&](std::string_view kind) {
    return std::find(request.hidden.begin(), request.hidden.end(), kind) != request.hidden.end();
  };
  const Scales scales = rehearse(blind);

  if (hides("viscous_friction")) blind.believed.remove(effect_number("viscous_friction"));
  const bool cart = blind.campaign != "locked";
  if (cart && chance(random, chance_of_known_dry_friction(request, 0.25)))
    blind.believed.set("coulomb_friction", {between(random, 0.07, 0.15) * scales.force_n});

  Plant truth = nearly_as_believed(blind, 0.03, random);

  blind.rig.cart_step_m = one_of(random, std::array{1e-5, 2.27485e-5, 5e-5});
  blind.rig.theta_step_rad =
      2.0 * std::numbers::pi / one_of(random, std::array{4096.0, 4096.0, 8192.0, 2400.0});
  blind.rig.actual_times = chance(random, 0.5);
  if (request.condition == Condition::disturbed) {
    blind.rig.disturbance_n = 0.05;
    blind.rig.jitter_s = between(random, 20e-6, 150e-6);
  }
  hide_effects(blind, scales, truth, random);
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
