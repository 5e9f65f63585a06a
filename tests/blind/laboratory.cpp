#include "laboratory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "design/gain_design.hpp"

namespace upright::blind {

namespace {

constexpr double largest_voltage_v = 10.0;
/// The cart of the paper drives at about half a metre per second over about half a metre.
constexpr double usual_speed_mps = 0.5;

bool hides_kind(const Request& request, std::string_view kind) {
  return std::find(request.hidden.begin(), request.hidden.end(), kind) != request.hidden.end();
}

/// A rig of any size. `reach`: its travel and speed, relative to the cart of the paper. From the time
/// constant follows the damping, from the top speed the gear.
Plant draw_plant(Random& random, bool pendulum, double reach) {
  Plant plant;
  plant.cart_mass_kg = between_by_ratio(random, 0.3, 100.0);
  plant.gravity_mps2 = 9.81;
  if (pendulum)
    plant.pendulum = Pendulum{plant.cart_mass_kg * between_by_ratio(random, 0.05, 0.5),
                              between(random, 0.15, 0.5) * std::sqrt(reach),
                              {}};
  const double total_kg = plant.cart_mass_kg + (pendulum ? plant.pendulum->mass_kg : 0.0);
  const double damping_n_per_mps = total_kg / between_by_ratio(random, 0.05, 0.3);
  const double back_emf_share = between(random, 0.5, 0.9);
  const double top_speed_mps = usual_speed_mps * reach * between(random, 2.0, 5.0);
  plant.motor = {damping_n_per_mps * top_speed_mps / largest_voltage_v, damping_n_per_mps * back_emf_share};
  plant.set("viscous_friction", {damping_n_per_mps * (1.0 - back_emf_share)});
  return plant;
}

/// 1 to 8 runs of 2 to 60 s, as many as the samples allow.
std::vector<double> draw_durations(const Request& request, double rate_hz, Random& random) {
  int runs = request.runs > 0 ? request.runs : std::uniform_int_distribution<int>(1, 8)(random);
  const double total_s = request.max_samples / rate_hz;
  std::vector<double> durations;
  double left_s = total_s;
  constexpr double shortest_s = 2.0, longest_s = 60.0;
  for (; runs > 0 && left_s >= shortest_s; --runs) {
    double duration_s = between_by_ratio(random, shortest_s, longest_s);
    if (request.duration_s > 0.0) duration_s = request.duration_s;
    durations.push_back(std::min(duration_s, left_s));
    left_s -= durations.back();
  }
  if (durations.empty()) durations.push_back(total_s);
  return durations;
}

Plan draw_plan(Experiment experiment, double volts_per_mps, double reach, Random& random) {
  Plan plan;
  plan.experiment = experiment;
  plan.reach = reach;
  plan.amplitude_v = between(random, 0.4, 1.0) * usual_speed_mps * reach * volts_per_mps;
  plan.centring_v_per_m = 1.2 * volts_per_mps;
  plan.loop_delay_s = chance(random, 0.5) ? between(random, 0.0, 0.01) : 0.0;
  plan.swing_rad = either_sign(random) * between(random, 0.1, 0.8);
  if (experiment == Experiment::coast) plan.swing_rad = either_sign(random) * between(random, 0.5, 1.5);
  if (experiment == Experiment::locked_swing)
    plan.swing_rad = either_sign(random) * between(random, 0.4, 2.0);
  if (experiment == Experiment::balance) plan.swing_rad = either_sign(random) * between(random, 0.0, 0.05);
  return plan;
}

std::vector<Plan> draw_plans(const Case& blind, double rate_hz, double reach, Random& random) {
  const Plant& believed = blind.believed;
  const double volts_per_mps = damping_of(believed) / believed.motor.force_per_volt_n;
  const std::vector<double> durations = draw_durations(blind.request, rate_hz, random);
  const int runs = static_cast<int>(durations.size());
  std::array<double, 4> gains{};
  if (believed.pendulum) gains = design_gains(believed, {}, 100.0).gains;
  std::vector<Plan> plans;
  for (int r = 0; r < runs; ++r) {
    Plan plan =
        draw_plan(choose_experiment(blind.campaign, rate_hz, r, runs, random), volts_per_mps, reach, random);
    plan.rate_hz = rate_hz;
    plan.duration_s = durations[static_cast<std::size_t>(r)];
    plan.gains = gains;
    if (plan.experiment == Experiment::balance && chance(random, 0.2))
      plan.let_go_s = between(random, 0.4, 0.8) * plan.duration_s;
    if (chance(random, 0.2))
      plan.gaps_s.emplace_back(between(random, 0.2, 0.8) * plan.duration_s,
                               between(random, 0.01, 0.05) * plan.duration_s);
    plan.seed = random();
    plans.push_back(plan);
  }
  return plans;
}

void draw_sensors(Rig& rig, double reach, Random& random) {
  rig.actual_times = chance(random, 0.5);
  rig.jitter_s = chance(random, 0.5) ? between(random, 20e-6, 150e-6) : 0.0;
  if (chance(random, 0.5)) {
    rig.cart_step_m = reach * between_by_ratio(random, 1e-5, 1e-4);
    rig.theta_step_rad = 2.0 * std::numbers::pi / one_of(random, std::array{1024.0, 2400.0, 4096.0, 8192.0});
    return;
  }
  rig.cart_step_m = rig.theta_step_rad = 0.0;
  rig.cart_noise_m = reach * between_by_ratio(random, 5e-6, 2e-4);
  rig.theta_noise_rad = between_by_ratio(random, 1e-4, 2e-3);
  if (chance(random, 0.4)) {
    rig.noise_colour = between(random, 0.1, 0.4);
    rig.noise_time_s = between_by_ratio(random, 0.005, 0.1);
  }
}

/// Up to two thirds of what a weak effect takes.
void draw_disturbances(Rig& rig, const Scales& scales, double reach, Random& random) {
  ColouredDisturbance& coloured = rig.coloured;
  coloured.force_n = between_by_ratio(random, 0.003, 0.02) * scales.force_n;
  coloured.force_time_s = between_by_ratio(random, 0.01, 1.0);
  coloured.torque_nm = between_by_ratio(random, 0.001, 0.006) * scales.gravity_torque_nm;
  coloured.torque_time_s = between_by_ratio(random, 0.01, 1.0);
  if (chance(random, 0.5)) coloured.speed_mps = scales.speed_mps / between(random, 1.0, 3.0);
  rig.track_seed = random();
  rig.rough_length_m = reach * between_by_ratio(random, 0.003, 0.03);
  const double rough_n = between_by_ratio(random, 0.003, 0.015) * scales.force_n;
  if (chance(random, 1.0 / 3.0)) rig.rough_n = rough_n;
}

}  // namespace

Case make_laboratory_case(const Request& request) {
  Random random(request.seed * 2654435761 + 97);
  Case blind;
  blind.request = request;
  double rate_hz = one_of(random, std::array{100.0, 125.0, 200.0, 250.0, 400.0, 500.0, 1000.0, 2000.0});
  if (request.rate_hz > 0.0) rate_hz = request.rate_hz;
  const double reach = between_by_ratio(random, 0.5, 3.0);
  blind.campaign = choose_campaign(request, rate_hz, random);
  blind.believed = draw_plant(random, blind.campaign != "cart_alone", reach);
  blind.plans = draw_plans(blind, rate_hz, reach, random);
  const Scales scales = rehearse(blind);

  if (hides_kind(request, "viscous_friction")) blind.believed.remove(effect_number("viscous_friction"));
  if (blind.campaign != "locked" && chance(random, chance_of_known_dry_friction(request, 0.5)))
    blind.believed.set("coulomb_friction", {between(random, 0.03, 0.2) * scales.force_n});
  Plant truth = nearly_as_believed(blind, 0.05, random);
  draw_sensors(blind.rig, reach, random);
  draw_disturbances(blind.rig, scales, reach, random);

  hide_effects(blind, scales, truth, random);
  blind.rig.plant = truth;
  return blind;
}

Measurement measure_fresh(const Case& blind) {
  Plan plan = blind.plans.front();
  plan.gaps_s.clear();
  plan.seed ^= 0x9e3779b97f4a7c15;
  return measure(blind.rig, plan, "fresh");
}

}  // namespace upright::blind
