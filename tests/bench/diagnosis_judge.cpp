#include "diagnosis_judge.hpp"

#include <algorithm>
#include <string>

#include "diagnosis/candidates.hpp"
#include "laboratory.hpp"

namespace upright::blind {

namespace {

using nlohmann::json;

constexpr double shown_evidence = 25.0;
constexpr double shown_ratio = 1.2;

/// How much larger a base parameter of `start` is than the believed one, as the effect that corrects it says
/// it.
double base_scale(const Plant& believed, const Plant& start, const std::string& kind) {
  if (kind == "cart_mass") return start.cart_mass_kg / believed.cart_mass_kg;
  if (kind == "back_emf" && believed.motor.back_emf_n_per_mps > 0.0)
    return start.motor.back_emf_n_per_mps / believed.motor.back_emf_n_per_mps;
  if (kind == "pendulum_mass" && believed.pendulum)
    return start.pendulum->mass_kg / believed.pendulum->mass_kg;
  if (kind == "pendulum_length" && believed.pendulum)
    return start.pendulum->length_to_com_m / believed.pendulum->length_to_com_m;
  return effect_registry()[effect_number(kind)].parameters[0].neutral;
}

/// From what the sensors show to what is.
void unscale(const Plant& plant, PlantState<double>& state) {
  const auto value = [&](const char* kind, double neutral) {
    const PlantEffect* effect = plant.find(kind);
    return effect != nullptr ? effect->values[0] : neutral;
  };
  const double cart = value("cart_scale", 1.0), angle = value("angle_scale", 1.0);
  state.cart_m /= cart;
  state.cart_mps /= cart;
  state.theta_rad = (state.theta_rad - value("angle_offset", 0.0)) / angle;
  state.theta_radps /= angle;
}

/// A structure fitted to all runs, from the numbers of `start`: everything the plant file has within what is
/// believed of it, these effects free.
FitResult fit_structure(const std::vector<Measurement>& runs, const Plant& believed, const Plant& start,
                        const std::vector<std::size_t>& effects, const Noise& noise) {
  const SelectionPolicy policy;
  const DataRange range = range_of(runs, believed, policy.excitation);
  FitData data{&runs, cut_segments(runs)};
  FitPoint point{believed, {}, noise};
  std::vector<FreeParameter> free;
  const auto include = [&](const std::vector<FreeParameter>& more) {
    free.insert(free.end(), more.begin(), more.end());
  };
  const auto added = [&](std::size_t effect) {
    return std::find(effects.begin(), effects.end(), effect) != effects.end();
  };
  for (const PlantEffect& effect : believed.effects) {
    if (added(effect.number)) continue;
    if (const PlantEffect* from = start.find(effect.number)) point.plant.set(effect.number, from->values);
    include(correction_parameters(believed, effect.number, range, policy.prior));
  }
  for (const std::size_t effect : base_corrections(believed, range)) {
    point.plant.set(effect, std::vector<double>{base_scale(believed, start, kind_of(effect))});
    if (!added(effect)) include(correction_parameters(believed, effect, range, policy.prior));
  }
  for (const std::size_t effect : effects) {
    if (const PlantEffect* from = start.find(effect)) point.plant.set(effect, from->values);
    include(free_parameters(effect, range, policy.prior));
  }
  point.starts = estimate_initial_states(runs, data.segments, point.plant);
  for (PlantState<double>& state : point.starts) unscale(point.plant, state);
  // To convergence: a fit that stops early would pass for a structure that fits worse.
  FitOptions options;
  options.max_iterations = 40;
  options.noise_rounds = 8;
  options.tolerance = 1e-6;
  FitResult best = fit(data, point, free, options);
  // A wrong start and much noise can hold each other up; from little noise the way is another.
  point = best.point;
  point.noise.force *= 0.1;
  point.noise.torque *= 0.1;
  const FitResult again = fit(data, point, free, options);
  return again.objective < best.objective ? again : best;
}

/// Root mean square of a plain simulation of these runs, in units of the sensors' noise.
double plain_rms(const std::vector<Measurement>& runs, const Plant& plant,
                 const std::vector<std::size_t>& which) {
  FitData data{&runs, {}};
  for (const Segment& segment : cut_segments(runs))
    if (std::find(which.begin(), which.end(), segment.run) != which.end()) data.segments.push_back(segment);
  if (data.segments.empty()) return 0.0;
  return whitened_rms(
      fit_initial_states(data, {plant, estimate_initial_states(runs, data.segments, plant), {}}));
}

std::vector<std::size_t> all_runs(const std::vector<Measurement>& runs) {
  std::vector<std::size_t> which;
  for (std::size_t r = 0; r < runs.size(); ++r) which.push_back(r);
  return which;
}

/// Effects that are exactly the same force as this one in the true plant (docs/reference/effects.md).
std::vector<std::string> same_force(const std::string& kind, const Plant& truth) {
  if (kind == "viscous_friction") return {"back_emf"};
  if (kind == "back_emf") return {"viscous_friction"};
  if (kind == "constant_force") return {"voltage_offset", "friction_asymmetry"};
  if (kind == "voltage_offset") return {"constant_force", "friction_asymmetry"};
  if (kind == "friction_asymmetry") {
    const PlantEffect* coulomb = truth.find("coulomb_friction");
    const double d = truth.find(kind)->values[0];
    if (coulomb != nullptr && coulomb->values[0] > std::abs(d)) return {"constant_force", "voltage_offset"};
  }
  return {};
}

/// Where fits start the noise: what the forces of the rig of the paper call for, in proportion.
Noise start_noise(const Case& blind) {
  Noise noise = {.force = 0.05, .torque = 0.002};
  if (blind.request.condition != Condition::laboratory) return noise;
  constexpr double usual_force_per_volt_n = 1.7189, usual_gravity_torque_nm = 0.628;
  const Plant& plant = blind.believed;
  noise.force *= plant.motor.force_per_volt_n / usual_force_per_volt_n;
  if (plant.pendulum)
    noise.torque *= plant.pendulum->mass_kg * plant.gravity_mps2 * plant.pendulum->length_to_com_m /
                    usual_gravity_torque_nm;
  return noise;
}

std::vector<std::size_t> hidden_effects(const Case& blind) {
  std::vector<std::size_t> hidden;
  for (const HiddenEffect& effect : blind.hidden) hidden.push_back(effect.effect);
  return hidden;
}

void judge_unknown(const Case& blind, const std::vector<Measurement>& runs, json& record) {
  const double quiet = plain_rms(measure_all(blind, true), blind.rig.plant, all_runs(runs));
  const double with = plain_rms(runs, blind.rig.plant, all_runs(runs));
  record["further_off"] = with / quiet;
  record["shown"] = with / quiet > shown_ratio;
}

/// The rig without what is hidden, with the same draws.
Case without_hidden(const Case& blind) {
  Case without = blind;
  Plant& plant = without.rig.plant;
  for (const HiddenEffect& effect : blind.hidden) {
    const PlantEffect* believed = blind.believed.find(effect.effect);
    plant.remove(effect.effect);
    if (believed != nullptr) plant.set(effect.effect, believed->values);
  }
  return without;
}

/// What the true structure saves where what is hidden is not there.
double evidence_without(const Case& blind) {
  const Case without = without_hidden(blind);
  const std::vector<Measurement> runs = measure_all(without);
  const Noise noise = start_noise(blind);
  const FitResult base = fit_structure(runs, blind.believed, blind.believed, {}, noise);
  const FitResult more =
      fit_structure(runs, blind.believed, blind.rig.plant, hidden_effects(blind), base.point.noise);
  return base.objective - more.objective;
}

/// How much less likely a pair makes the data without one of the two.
double min_evidence(const Case& blind, const std::vector<Measurement>& runs, const DataJudgement& data) {
  double evidence = data.base.objective - data.truth.objective;
  const std::vector<std::size_t> hidden = hidden_effects(blind);
  if (hidden.size() < 2) return evidence;
  for (const std::size_t effect : hidden)
    evidence = std::min(
        evidence,
        fit_structure(runs, blind.believed, blind.rig.plant, {effect}, data.base.point.noise).objective -
            data.truth.objective);
  return evidence;
}

}  // namespace

DataJudgement judge_data(const Case& blind, const std::vector<Measurement>& runs, json& record) {
  if (blind.rig.unknown != Unknown::none) {
    judge_unknown(blind, runs, record);
    return {};
  }
  const std::vector<std::size_t> hidden = hidden_effects(blind);
  if (hidden.empty()) return {};
  DataJudgement data;
  data.base = fit_structure(runs, blind.believed, blind.believed, {}, start_noise(blind));
  data.truth = fit_structure(runs, blind.believed, blind.rig.plant, hidden, data.base.point.noise);
  record["evidence"] = data.base.objective - data.truth.objective;
  const double evidence = min_evidence(blind, runs, data);
  record["least_evidence"] = evidence;
  record["shown"] = evidence > shown_evidence;
  if (blind.request.condition == Condition::laboratory && evidence > shown_evidence) {
    const double alone = evidence_without(blind);
    record["evidence_without"] = alone;
    record["clearly_shown"] = evidence > clear_factor * alone;
  }
  if (hidden.size() == 1) record["same_force"] = same_force(kind_of(hidden[0]), blind.rig.plant);
  return data;
}

void judge_name(const Case& blind, const std::vector<Measurement>& runs, const DataJudgement& data,
                const Diagnosis& diagnosis, json& record) {
  if (blind.hidden.size() != 1 || blind.rig.unknown != Unknown::none) return;
  if (diagnosis.effects.empty() || diagnosis.effects[0].effect == blind.hidden[0].effect) return;
  const FitResult named = fit_structure(runs, blind.believed, diagnosis.model, {diagnosis.effects[0].effect},
                                        data.base.point.noise);
  record["worse_if_named"] = named.objective - data.truth.objective;
}

void judge_gap(const Case& blind, const std::vector<Measurement>& runs, const Diagnosis& d, json& record) {
  const std::vector<std::size_t> held = d.held_out_runs.empty() ? all_runs(runs) : d.held_out_runs;
  const double truth = plain_rms(runs, blind.rig.plant, held);
  record["plain_truth"] = truth;
  record["plain_before"] = plain_rms(runs, blind.believed, held);
  record["plain_after"] = plain_rms(runs, d.model, held);
  record["over_floor"] = record["plain_after"].get<double>() / truth;
  if (blind.request.condition != Condition::laboratory) return;
  const std::vector<Measurement> fresh = {measure_fresh(blind)};
  record["fresh_truth"] = plain_rms(fresh, blind.rig.plant, {0});
  record["fresh_before"] = plain_rms(fresh, blind.believed, {0});
  record["fresh_after"] = plain_rms(fresh, d.model, {0});
}

}  // namespace upright::blind
