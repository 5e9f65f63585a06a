#include "candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "attached_mass_search.hpp"
#include "estimation/segments.hpp"
#include "motion_range.hpp"

namespace upright {

namespace {

bool is_named(std::size_t effect, std::string_view kind) {
  return effect_registry()[effect].kind == kind;
}

/// A table fits anything, so it is no name: the search leaves it out, and holds one that the plant file has.
bool is_table(std::size_t effect) {
  return effect == effect_index<effects::ForceTable>();
}

/// A ripple with the velocity is described by a curve. It is fitted where the plant file has it.
bool is_searched_for(std::size_t effect) {
  return !is_table(effect) && effect != effect_index<effects::VelocityRipple>();
}

/// Of the forces at work in these runs, whatever the size of the rig: a few percent of the motor's. In the
/// pivot, a share of gravity's torque.
double order_of_magnitude(const ParameterInfo& info, const DataRange& range, const PriorPolicy& prior) {
  const double force = usual_force_n(range, prior);
  const double speed = range.largest_speed_mps, travel = range.longest_travel_m;
  double order = 0.0;
  if (info.unit == "N") order = force;
  if (info.unit == "N/m" && travel > 0.0) order = force / travel;
  if (info.unit == "N s/m" && speed > 0.0) order = force / speed;
  if (info.unit == "N s^2/m^2" && speed > 0.0) order = force / (speed * speed);
  const double torque = usual_torque_nm(range, prior);
  const double rate = range.pendulum_rate_radps;
  if (info.unit == "N m") order = torque;
  if (info.unit == "N m s/rad" && rate > 0.0) order = torque / rate;
  if (info.unit == "N m s^2/rad^2" && rate > 0.0) order = torque / (rate * rate);
  return std::max(info.typical, order);
}

FreeParameter free_parameter(std::size_t effect, std::size_t index, const DataRange& range,
                             const PriorPolicy& prior) {
  const ParameterInfo& info = effect_registry()[effect].parameters[index];
  FreeParameter p;
  p.effect = effect;
  p.index = index;
  p.low = info.range.low;
  p.high = info.range.high;
  p.scale = order_of_magnitude(info, range, prior);
  if (p.scale == 0.0) p.scale = 0.1;
  if (info.range.low_open && info.range.low == 0.0) p.low = 1e-3 * p.scale;
  return p;
}

}  // namespace

double usual_force_n(const DataRange& range, const PriorPolicy& prior) {
  return prior.share_of_motor_force * range.largest_force_n;
}

double usual_torque_nm(const DataRange& range, const PriorPolicy& prior) {
  return prior.share_of_gravity_torque * range.gravity_torque_nm;
}

DataRange range_of(const std::vector<Measurement>& runs, const Plant& plant, const ExcitationPolicy& policy) {
  DataRange range;
  range.cart_mass_kg = plant.cart_mass_kg;
  double sum = 0.0, count = 0.0;
  range.shortest_period_s = 1.0;
  range.measured = motion_range(runs, policy.speed_window_s);
  for (const QuantityRange& of : range.measured) {
    const double largest = std::max(std::abs(of.low), std::abs(of.high));
    if (of.quantity == "cart_mps") range.largest_speed_mps = largest;
    if (of.quantity != "cart_m") continue;
    range.cart_low_m = of.low;
    range.cart_high_m = of.high;
  }
  for (const Segment& s : cut_segments(runs))
    range.longest_segment_s =
        std::max(range.longest_segment_s, runs[s.run].time_s[s.last] - runs[s.run].time_s[s.first]);
  for (const Measurement& run : runs) {
    range.longest_run_s = std::max(range.longest_run_s, run.time_s.back() - run.time_s.front());
    range.theta_measured = range.theta_measured || run.has_theta();
    range.theta_resolution_rad = std::max(range.theta_resolution_rad, run.theta_resolution_rad);
    // The error of steps is as large as a noise of step / sqrt(12).
    if (run.has_theta())
      range.theta_step_rad = std::max(range.theta_step_rad, std::sqrt(12.0) * run.theta_noise_rad());
    range.shortest_period_s = std::min(range.shortest_period_s, run.median_period_s());
    double square = 0.0;
    for (const double v : run.voltage_v) {
      range.largest_voltage_v = std::max(range.largest_voltage_v, std::abs(v));
      square += v * v / static_cast<double>(run.size());
    }
    range.motor_force_rms_n =
        std::max(range.motor_force_rms_n, plant.motor.force_per_volt_n * std::sqrt(square));
    if (!run.has_cart()) continue;
    range.cart_moves = true;
    const auto [low, high] = std::minmax_element(run.cart_m.begin(), run.cart_m.end());
    range.longest_travel_m = std::max(range.longest_travel_m, *high - *low);
    for (const double x : run.cart_m) {
      sum += x;
      count += 1.0;
    }
  }
  range.cart_mean_m = count > 0.0 ? sum / count : 0.0;
  range.largest_force_n = plant.motor.force_per_volt_n * range.largest_voltage_v;
  if (plant.pendulum) {
    const Pendulum& pendulum = *plant.pendulum;
    range.gravity_torque_nm = pendulum.mass_kg * plant.gravity_mps2 * pendulum.length_to_com_m;
    range.pendulum_rate_radps = std::sqrt(range.gravity_torque_nm / pendulum.inertia_about_pivot_kgm2());
  }
  return range;
}

bool moves_enough(const std::vector<Measurement>& runs, const ExcitationPolicy& policy) {
  const auto range = [](const std::vector<double>& values) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    return values.empty() ? 0.0 : *high - *low;
  };
  return std::any_of(runs.begin(), runs.end(), [&](const Measurement& run) {
    return range(run.cart_m) > policy.min_steps * std::sqrt(12.0) * run.cart_noise_m() ||
           range(run.theta_rad) > policy.min_steps * std::sqrt(12.0) * run.theta_noise_rad();
  });
}

std::vector<FreeParameter> free_parameters(std::size_t effect, const DataRange& range,
                                           const PriorPolicy& prior) {
  const EffectInfo& info = effect_registry()[effect];
  std::vector<FreeParameter> free;
  if (is_table(effect)) return free;
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    FreeParameter p = free_parameter(effect, i, range, prior);
    const std::string_view name = info.parameters[i].name;
    if (info.enters == Enters::cart && info.dry && info.parameters[i].unit == "N" &&
        range.largest_force_n > 0.0) {
      // Dry friction that the motor cannot overcome would hold the cart for good.
      p.high = std::min(p.high, prior.max_share_of_motor_force * range.largest_force_n);
    }
    if (name == "shape") {
      p.prior_mean = prior.shape_mean;
      p.prior_sigma = prior.shape_sigma;
      p.low = prior.min_shape;
      p.high = prior.max_shape;
    } else if (is_named(effect, "stribeck_friction") && name == "velocity_mps") {
      p.low = prior.min_stribeck_mps;
      p.high = std::max(prior.fastest_stribeck_mps, prior.max_stribeck_share * range.largest_speed_mps);
    } else if (is_named(effect, "warming_friction") && name == "time_constant_s") {
      p.low = prior.min_warming_share * range.longest_run_s;
      p.high = prior.max_warming_share * range.longest_run_s;
    } else if (name == "pitch_m") {
      p.low = prior.min_pitch_m;
      p.high = longest_pitch_m(range, prior);
    } else if (name == "center_m") {
      p.prior_mean = range.cart_mean_m;
      p.prior_sigma = prior.spring_center_m;
    } else if (name == "stiffness_n_per_m" && is_named(effect, "bristle_friction")) {
      p.low = prior.min_bristle_stiffness_n_per_m;
      p.high = prior.max_bristle_stiffness_n_per_m;
    } else if (name == "damping_n_per_mps" && is_named(effect, "bristle_friction")) {
      // The critical damping of the cart on the stiffest bristles. A damper that is much stronger holds the
      // cart as a rigid contact does, and is followed in tiny steps.
      p.high = 2.0 * std::sqrt(prior.max_bristle_stiffness_n_per_m * range.cart_mass_kg);
    } else if (is_named(effect, "lost_counts") && name == "share") {
      p.low = prior.min_lost_share;
    } else if (is_named(effect, "input_delay")) {
      p.high = prior.max_delay_s;
    } else if (is_named(effect, "motor_lag")) {
      p.low = prior.min_lag_periods * range.shortest_period_s;
      p.high = prior.max_lag_s;
    } else if (name == "scale") {
      p.low = prior.min_scale;
      p.high = prior.max_scale;
      p.scale = 0.1;
      p.prior_mean = 1.0;
      p.prior_sigma = prior.scale;
    }
    free.push_back(p);
  }
  if (attaches_mass(effect)) limit_attached_mass(effect, range, prior, free);
  return free;
}

namespace {

/// Names of one and the same force, the one that supposes least first.
constexpr std::array<std::string_view, 3> one_force = {"constant_force", "friction_asymmetry",
                                                       "voltage_offset"};

std::size_t place_among_one_force(std::size_t effect) {
  const auto place = std::find(one_force.begin(), one_force.end(), effect_registry()[effect].kind);
  return static_cast<std::size_t>(place - one_force.begin());
}

}  // namespace

bool is_plainer(std::size_t a, std::size_t b) {
  const std::size_t parameters_a = effect_registry()[a].parameters.size();
  const std::size_t parameters_b = effect_registry()[b].parameters.size();
  if (parameters_a != parameters_b) return parameters_a < parameters_b;
  const std::size_t place_a = place_among_one_force(a), place_b = place_among_one_force(b);
  if (std::max(place_a, place_b) < one_force.size()) return place_a < place_b;
  return a < b;
}

std::vector<std::size_t> same_force_as(std::size_t effect) {
  std::vector<std::size_t> others;
  if (place_among_one_force(effect) == one_force.size()) return others;
  for (const std::string_view kind : one_force)
    if (effect_number(kind) != effect) others.push_back(effect_number(kind));
  return others;
}

bool is_plainer_name(std::size_t a, std::size_t b) {
  return std::max(place_among_one_force(a), place_among_one_force(b)) < one_force.size() && is_plainer(a, b);
}

std::vector<FreeParameter> correction_parameters(const Plant& plant, std::size_t effect,
                                                 const DataRange& range, const PriorPolicy& prior) {
  const EffectInfo& info = effect_registry()[effect];
  const PlantEffect* have = plant.find(effect);
  std::vector<FreeParameter> free;
  if (is_table(effect)) return free;
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    FreeParameter p = free_parameter(effect, i, range, prior);
    p.prior_mean = have != nullptr ? have->values[i] : info.parameters[i].neutral;
    const double relative_sigma = info.enters == Enters::parameter ? prior.base_parameter : prior.friction;
    const double size =
        std::max(std::abs(p.prior_mean), prior.min_share_of_typical * info.parameters[i].typical);
    p.prior_sigma = relative_sigma * size;
    p.scale = size;
    if (is_named(effect, "angle_offset") && have == nullptr) {
      // An incremental encoder knows its zero to a count, and friction lets a pendulum rest a little off.
      p.prior_sigma = std::max(range.theta_resolution_rad, prior.rest_rad);
      p.scale = p.prior_sigma;
    }
    if (info.enters == Enters::parameter) {
      p.low = prior.min_scale;
      p.high = prior.max_scale;
      p.scale = 0.1;
    }
    free.push_back(p);
  }
  return free;
}

std::vector<std::size_t> base_corrections(const Plant& plant, const DataRange& range) {
  std::vector<std::size_t> effects;
  for (std::size_t i = 0; i < effect_count; ++i) {
    const EffectInfo& info = effect_registry()[i];
    if (info.enters != Enters::parameter || plant.find(i) != nullptr) continue;
    const bool of_pendulum = info.kind.starts_with("pendulum_");
    if (of_pendulum && !plant.pendulum) continue;
    if (of_pendulum && !range.theta_measured && !range.cart_moves) continue;
    // With the cart held, the mass of the pendulum divides out of its motion but for friction in the pivot,
    // which is known no better than the mass.
    const bool needs_cart = !of_pendulum;
    if (needs_cart && !range.cart_moves) continue;
    effects.push_back(i);
  }
  const std::size_t zero = effect_number("angle_offset");
  if (plant.pendulum && range.theta_measured && plant.find(zero) == nullptr) effects.push_back(zero);
  return effects;
}

namespace {

/// Candidates among the effects for which `is_asked` holds.
template <class IsAsked>
std::vector<std::size_t> candidates_among(const Plant& plant, const DataRange& range,
                                          const IsAsked& is_asked) {
  std::vector<std::size_t> effects;
  for (std::size_t i = 0; i < effect_count; ++i) {
    if (!is_asked(i)) continue;
    const EffectInfo& info = effect_registry()[i];
    if (plant.find(i) != nullptr || info.enters == Enters::parameter || !is_searched_for(i)) continue;
    const bool angle = info.kind.starts_with("angle_");
    if ((info.enters == Enters::pendulum || angle) && !plant.pendulum) continue;
    if ((info.enters == Enters::pendulum || angle) && !range.theta_measured) continue;
    const bool of_motor =
        info.enters == Enters::actuator || is_named(i, "drive_compliance") || is_named(i, "torque_ripple");
    const bool of_cart_encoder = info.enters == Enters::sensor && !angle;
    if ((info.enters == Enters::cart || of_cart_encoder) && !range.cart_moves) continue;
    if (of_motor && (!range.cart_moves || range.largest_voltage_v == 0.0)) continue;
    Plant with = plant;
    std::vector<double> typical;
    for (const ParameterInfo& parameter : info.parameters) typical.push_back(parameter.typical);
    with.set(i, typical);
    if (fault_of(with).empty()) effects.push_back(i);
  }
  return effects;
}

/// Soft and stiff bristles: under the motor's largest force, they bend over a fifth and an eightieth of the
/// travel. Half of the critical damping of the cart on them.
std::vector<std::vector<double>> bristle_starts(const EffectInfo& info, const DataRange& range) {
  const double n_per_m = range.longest_travel_m > 0.0 ? range.largest_force_n / range.longest_travel_m : 0.0;
  if (!(n_per_m > 0.0)) return {{info.parameters[0].typical, info.parameters[1].typical}};
  std::vector<std::vector<double>> starts;
  for (const double share : {0.2, 0.0125}) {
    const double stiffness_n_per_m = n_per_m / share;
    starts.push_back({stiffness_n_per_m, std::sqrt(stiffness_n_per_m * range.cart_mass_kg)});
  }
  return starts;
}

/// A counter that loses one count or two of each beyond its fastest rate shows no faster motion. Noise makes
/// the largest speed too large, and beyond all speeds nothing is lost, so one start is below it.
std::vector<std::vector<double>> lost_counts_starts(double largest_counted_mps) {
  return {{1.0, 0.9 * largest_counted_mps}, {2.0, largest_counted_mps}};
}

}  // namespace

std::vector<std::size_t> candidate_effects(const Plant& plant, const DataRange& range) {
  return candidates_among(plant, range, [](std::size_t effect) { return !attaches_mass(effect); });
}

std::vector<std::size_t> attached_mass_candidates(const Plant& plant, const DataRange& range) {
  return candidates_among(plant, range, attaches_mass);
}

std::vector<std::vector<double>> search_starts(std::size_t effect, const DataRange& range,
                                               const PriorPolicy& prior, const SearchBudget& budget) {
  const EffectInfo& info = effect_registry()[effect];
  const double speed = range.largest_speed_mps, volts = range.largest_voltage_v;
  if (attaches_mass(effect)) return attached_mass_starts(effect, range, prior);
  if (is_periodic(effect)) return periodic_starts(effect, {}, range, prior, budget);
  if (is_named(effect, "voltage_saturation"))
    return {{highest_saturation_start * volts}, {0.7 * volts}, {0.5 * volts}, {0.3 * volts}};
  if (is_named(effect, "voltage_dead_zone")) {
    const double usual_v = std::max(info.parameters[0].typical, prior.share_of_motor_force * volts);
    return {{usual_v / 3.0}, {4.0 * usual_v / 3.0}};
  }
  if (is_named(effect, "stribeck_friction")) {
    const double extra_n = 0.4 * order_of_magnitude(info.parameters[0], range, prior);
    return {{extra_n, std::max(0.005, std::min(0.1, 0.2 * speed)), 2.0},
            {extra_n, std::max(0.003, 0.03 * speed), 2.0}};
  }
  if (is_named(effect, "cable_spring"))
    return {{0.25 * order_of_magnitude(info.parameters[0], range, prior), range.cart_mean_m}};
  if (is_named(effect, "bristle_friction")) return bristle_starts(info, range);
  if (is_named(effect, "input_delay")) return {{0.5 * range.shortest_period_s}, {0.01}};
  if (is_named(effect, "motor_lag")) return {{std::max(0.001, 0.5 * range.shortest_period_s)}, {0.01}};
  if (is_named(effect, "warming_friction")) {
    const double force_n = 0.3 * order_of_magnitude(info.parameters[0], range, prior);
    const double time_constant_s = 0.3 * range.longest_run_s;
    return {{force_n, time_constant_s}, {-force_n, time_constant_s}};
  }
  if (effect == effect_index<effects::LostCounts>()) return lost_counts_starts(speed);
  if (info.enters == Enters::sensor) return {{info.parameters[0].neutral}};
  std::vector<double> start;
  for (const ParameterInfo& parameter : info.parameters)
    start.push_back(std::isfinite(parameter.neutral)
                        ? (parameter.neutral == 1.0 ? 1.0 : 0.1 * order_of_magnitude(parameter, range, prior))
                        : parameter.typical);
  if (info.parameters.size() > 1) return {start};
  const ParameterInfo& size = info.parameters[0];
  // A dry level is not below zero: where no other friction is known, nothing grows from nothing.
  if (info.dry && size.range.low < 0.0) return {{start[0]}, {-start[0]}};
  // A smooth force starts at nothing. Its sign is the data's, and no guess has to be taken back: in precise
  // data that is so much that what a first step promises says nothing.
  const bool may_vanish = size.neutral == 0.0 && size.range.low <= 0.0 && !size.range.low_open;
  return {{!info.dry && may_vanish ? 0.0 : start[0]}};
}

}  // namespace upright
