#include "effect_sizes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/rigid_body.hpp"

namespace upright::blind {

namespace {

double time_constant_s(const Plant& plant) {
  return (plant.cart_mass_kg + (plant.pendulum ? plant.pendulum->mass_kg : 0.0)) / damping_of(plant);
}

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

}  // namespace

std::string_view name_of(Size size) {
  return size == Size::weak ? "weak" : size == Size::typical ? "typical" : "strong";
}

double damping_of(const Plant& plant) {
  const PlantEffect* viscous = plant.find("viscous_friction");
  return plant.motor.back_emf_n_per_mps + (viscous != nullptr ? viscous->values[0] : 0.0);
}

const std::vector<std::string>& hidden_kinds() {
  static const std::vector<std::string> kinds = {"viscous_friction",
                                                 "coulomb_friction",
                                                 "friction_asymmetry",
                                                 "viscous_asymmetry",
                                                 "stribeck_friction",
                                                 "position_dependent_friction",
                                                 "warming_friction",
                                                 "load_dependent_friction",
                                                 "bristle_friction",
                                                 "quadratic_drag",
                                                 "constant_force",
                                                 "cable_spring",
                                                 "cogging_force",
                                                 "torque_ripple",
                                                 "voltage_saturation",
                                                 "voltage_dead_zone",
                                                 "voltage_gain",
                                                 "voltage_offset",
                                                 "input_delay",
                                                 "motor_lag",
                                                 "pivot_viscous_friction",
                                                 "pivot_coulomb_friction",
                                                 "pivot_quadratic_drag",
                                                 "drive_compliance",
                                                 "angle_offset",
                                                 "encoder_eccentricity",
                                                 "cart_scale",
                                                 "angle_scale",
                                                 "cart_mass",
                                                 "pendulum_mass",
                                                 "pendulum_length",
                                                 "back_emf"};
  return kinds;
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
  if (kind == "warming_friction") return {1.5 * force, between(random, 2.0, 6.0)};
  if (kind == "load_dependent_friction") return {share};
  if (kind == "quadratic_drag") return {force / (s.speed_mps * s.speed_mps)};
  if (kind == "cable_spring")
    return {force / (0.3 * s.travel_m), s.center_m + between(random, -0.3, 0.3) * s.travel_m};
  if (kind == "cogging_force")
    return {force, s.travel_m / between(random, 4.0, 15.0), between(random, -3.0, 3.0)};
  if (kind == "torque_ripple")
    return {1.5 * share, s.travel_m / between(random, 4.0, 15.0), between(random, -3.0, 3.0)};
  if (kind == "encoder_eccentricity")
    return {pick(size, 0.005, 0.02, 0.06) * between(random, 0.8, 1.25),
            s.travel_m / between(random, 4.0, 12.0), between(random, -3.0, 3.0)};
  if (kind == "lost_counts")
    return {between(random, 1.0, 2.0), s.speed_mps * pick(size, 1.8, 1.5, 1.1) * between(random, 0.8, 1.25)};
  if (kind == "drive_compliance") return {pick(size, 0.0002, 0.0006, 0.002) * s.travel_m / s.force_n};
  if (kind == "sprung_mass") {
    const double radps = between(random, 1.0, 6.0) / time_constant_s(plant);
    return {share * plant.cart_mass_kg, radps / (2.0 * std::numbers::pi), between(random, 0.03, 0.2)};
  }
  if (kind == "flexible_rod") {
    const double swing_radps = std::sqrt(plant.gravity_mps2 / rigid_body(plant).equivalent_length_m());
    return {pick(size, 0.1, 0.3, 0.7), between(random, 3.0, 10.0) * swing_radps / (2.0 * std::numbers::pi),
            between(random, 0.01, 0.1)};
  }
  if (kind == "backlash") {
    const double motor_share = between(random, 0.1, 0.4), contact_radps = between(random, 200.0, 600.0);
    return {pick(size, 0.0005, 0.002, 0.008) * s.travel_m, motor_share,
            motor_share * plant.cart_mass_kg * contact_radps * contact_radps,
            between(random, 0.5, 2.0) / s.speed_mps};
  }
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

}  // namespace upright::blind
