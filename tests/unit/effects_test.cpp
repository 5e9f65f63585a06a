// Each effect's own answer through the physics it enters, and a registry that is whole.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "plants.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/model/registry.hpp"

namespace upright {
namespace {

using test::paper_plant;
using Physics = Dynamics<double>;

Physics with(const char* kind, std::initializer_list<double> values) {
  Plant plant = paper_plant();
  plant.set(kind, values);
  return Physics(make_model<double>(plant));
}

/// Lagrange's equations of x, theta and q of the paper's plant at 1 V, before one was inserted in the others,
/// with a rod of {0.4, 8 Hz, 0.1}.
void expect_equations_of_a_bending_rod(const Plant& plant, const PlantState<double>& s,
                                       const PlantState<double>& rate) {
  const double moment = plant.pendulum->mass_kg * plant.pendulum->length_to_com_m;
  const double inertia = plant.pendulum->inertia_about_pivot_kgm2(), g = plant.gravity_mps2;
  const double h = 1.08975 * inertia / moment, m = 0.4 * inertia / (h * h), w = 2.0 * std::numbers::pi * 8.0;
  const double sine = std::sin(s.theta_rad), cosine = std::cos(s.theta_rad);
  const double q = s.attached_m, dq = s.attached_mps, omega = s.theta_radps;
  const double ddx = rate.cart_mps, ddth = rate.theta_radps, ddq = rate.attached_mps;
  EXPECT_DOUBLE_EQ(rate.attached_m, dq);
  const double rest_kg = plant.cart_mass_kg + plant.pendulum->mass_kg - m, rest_moment = moment - m * h;
  const double across = h * ddth + ddq, turning = h * omega + dq;
  const double rod_n = m * (ddx + across * cosine - turning * omega * sine - dq * omega * sine -
                            q * ddth * sine - q * omega * omega * cosine);
  const double motor_n = plant.motor.force_per_volt_n - plant.motor.back_emf_n_per_mps * s.cart_mps;
  EXPECT_NEAR(rest_kg * ddx + rest_moment * (cosine * ddth - sine * omega * omega) + rod_n, motor_n, 1e-12);
  const double rod_nm = m * (h * across + q * q * ddth + 2.0 * q * dq * omega +
                             ddx * (h * cosine - q * sine) - g * (h * sine + q * cosine));
  EXPECT_NEAR((inertia - m * h * h) * ddth + rest_moment * (cosine * ddx - g * sine) + rod_nm, 0.0, 1e-12);
  const double pull = 0.6 * (w * w * q + 2.0 * 0.1 * w * dq);
  EXPECT_NEAR(across + ddx * cosine - q * omega * omega - g * sine + pull, 0.0, 1e-11);
}

/// Force on the cart beyond motor and back-EMF.
double cart_force(const Physics& physics, double x, double v) {
  PlantState<double> s;
  s.cart_m = x;
  s.cart_mps = v;
  return physics.cart_smooth_force(s, 0.0) + 7.682 * v;
}

Outputs<double> shown(const Physics& physics) {
  PlantState<double> s;
  s.cart_m = 0.1;
  s.theta_rad = 0.2;
  return physics.measure(s);
}

const std::map<std::string, std::function<void()>>& answers() {
  static const std::map<std::string, std::function<void()>> all = {
      {"viscous_friction",
       [] { EXPECT_NEAR(cart_force(with("viscous_friction", {3.0}), 0.0, -0.4), 1.2, 1e-12); }},
      {"coulomb_friction",
       [] {
         const Physics p = with("coulomb_friction", {0.4});
         EXPECT_DOUBLE_EQ(p.cart_dry_level(0.3, 0.5, 1.0), 0.4);
         EXPECT_DOUBLE_EQ(p.cart_dry_level(-0.3, 0.0, -1.0), 0.4);
         EXPECT_TRUE(p.cart_can_stick());
       }},
      {"friction_asymmetry",
       [] {
         Plant plant = paper_plant();
         plant.set("coulomb_friction", {0.4});
         plant.set("friction_asymmetry", {0.1});
         const Physics p(make_model<double>(plant));
         EXPECT_DOUBLE_EQ(p.cart_dry_level(0.0, 0.2, 1.0), 0.5);
         EXPECT_DOUBLE_EQ(p.cart_dry_level(0.0, 0.2, -1.0), 0.4 - 0.1);
       }},
      {"viscous_asymmetry",
       [] {
         const Physics p = with("viscous_asymmetry", {0.5});
         EXPECT_NEAR(cart_force(p, 0.0, 0.4), -0.2, 1e-12);
         EXPECT_NEAR(cart_force(p, 0.0, -0.4), -0.2, 1e-12);
       }},
      {"stribeck_friction",
       [] {
         const Physics p = with("stribeck_friction", {0.5, 0.1, 2.0});
         EXPECT_DOUBLE_EQ(p.cart_dry_level(0.0, 0.0, 1.0), 0.5);
         EXPECT_NEAR(p.cart_dry_level(0.0, 0.1, 1.0), 0.5 * std::exp(-1.0), 1e-15);
         EXPECT_NEAR(with("stribeck_friction", {0.5, 0.1, 0.7}).cart_dry_level(0.0, 0.05, 1.0),
                     0.5 * std::exp(-std::pow(0.5, 0.7)), 1e-12);
       }},
      {"position_dependent_friction",
       [] {
         Plant plant = paper_plant();
         plant.set("coulomb_friction", {0.4});
         plant.set("position_dependent_friction", {0.5});
         const Physics p(make_model<double>(plant));
         EXPECT_DOUBLE_EQ(p.cart_dry_level(0.2, 0.1, -1.0), 0.5);
         EXPECT_EQ(p.cart_dry_level(-1.0, 0.1, 1.0), 0.0);
       }},
      {"warming_friction",
       [] {
         Plant plant = paper_plant();
         plant.set("coulomb_friction", {0.4});
         plant.set("warming_friction", {0.3, 2.0});
         PlantModel<double> model = make_model<double>(plant);
         model.start_s = 10.0;
         Physics p(model);
         EXPECT_TRUE(p.changes_with_time());
         EXPECT_DOUBLE_EQ(p.cart_dry_level(0.0, 0.1, 1.0), 0.4);
         p.set_time(10.0);
         EXPECT_DOUBLE_EQ(p.cart_dry_level(0.0, 0.1, -1.0), 0.7);
         p.set_time(12.0);
         EXPECT_NEAR(p.cart_dry_level(0.0, 0.0, 1.0), 0.4 + 0.3 * std::exp(-1.0), 1e-15);
       }},
      {"load_dependent_friction",
       [] {
         Plant plant = paper_plant();
         plant.set("coulomb_friction", {0.4});
         plant.set("load_dependent_friction", {0.1});
         plant.pendulum.reset();
         const Physics p(make_model<double>(plant));
         PlantState<double> s;
         s.cart_mps = 0.2;
         const double motor_n = 1.7189 * 3.0 - 7.682 * 0.2;
         EXPECT_NEAR(p.cart_dry_level_of_load(s, 3.0), 0.1 * motor_n, 1e-15);
         EXPECT_NEAR(p.derivative(s, 3.0, {}).cart_mps, (motor_n - 0.4 - 0.1 * motor_n) / 0.815, 1e-12);
         // While the motor brakes, friction adds to its force.
         const double braking_n = -1.7189 - 7.682 * 0.2;
         EXPECT_NEAR(p.derivative(s, -1.0, {}).cart_mps, (1.1 * braking_n - 0.4) / 0.815, 1e-12);
       }},
      {"bristle_friction",
       [] {
         Plant plant = paper_plant();
         plant.set("coulomb_friction", {0.4});
         plant.set("bristle_friction", {121.0, 70.0});
         const Physics p(make_model<double>(plant));
         PlantState<double> s;
         s.cart_mps = 0.2;
         s.bristle_m = 0.001;
         const double rate = 0.2 - 121.0 * 0.2 * 0.001 / 0.4;
         EXPECT_DOUBLE_EQ(p.derivative(s, 0.0, {}).bristle_m, rate);
         EXPECT_FALSE(p.cart_can_stick());
         plant.pendulum.reset();
         const Physics cart(make_model<double>(plant));
         EXPECT_NEAR(cart.derivative(s, 0.0, {}).cart_mps,
                     (-7.682 * 0.2 - 121.0 * 0.001 - 70.0 * rate) / 0.815, 1e-12);
       }},
      {"sprung_mass",
       [] {
         Plant plant = paper_plant();
         plant.set("sprung_mass", {0.2, 3.0, 0.1});
         plant.pendulum.reset();
         const Physics p(make_model<double>(plant));
         EXPECT_TRUE(p.has_attached_mass());
         PlantState<double> s;
         s.cart_mps = 0.2;
         s.attached_m = 0.01;
         s.attached_mps = -0.05;
         const double w = 2.0 * std::numbers::pi * 3.0;
         const double pull_mps2 = w * w * 0.01 - 2.0 * 0.1 * w * 0.05;
         const double cart_mps2 = (0.2 * pull_mps2 - 7.682 * 0.2) / 0.815;
         const PlantState<double> rate = p.derivative(s, 0.0, {});
         EXPECT_NEAR(rate.cart_mps, cart_mps2, 1e-12);
         EXPECT_DOUBLE_EQ(rate.attached_m, -0.05);
         EXPECT_NEAR(rate.attached_mps, -pull_mps2 - cart_mps2, 1e-12);
       }},
      {"quadratic_drag",
       [] { EXPECT_NEAR(cart_force(with("quadratic_drag", {2.0}), 0.0, -0.5), 0.5, 1e-12); }},
      {"constant_force",
       [] { EXPECT_NEAR(cart_force(with("constant_force", {0.3}), 0.0, 0.0), 0.3, 1e-12); }},
      {"cable_spring",
       [] {
         EXPECT_NEAR(cart_force(with("cable_spring", {2.0, 0.1}), 0.4, 0.0), -2.0 * 0.3, 1e-12);
       }},
      {"cogging_force",
       [] {
         const Physics p = with("cogging_force", {0.3, 0.01, 0.0});
         EXPECT_NEAR(cart_force(p, 0.0025, 0.0), 0.3, 1e-12);
         EXPECT_NEAR(cart_force(p, 0.0075, 0.0), -0.3, 1e-12);
       }},
      {"velocity_ripple",
       [] {
         const Physics p = with("velocity_ripple", {0.3, 0.2});
         EXPECT_NEAR(cart_force(p, 0.1, 0.05), 0.3, 1e-12);
         EXPECT_NEAR(cart_force(p, 0.1, -0.05), -0.3, 1e-12);
         EXPECT_NEAR(cart_force(p, 0.1, 0.15), -0.3, 1e-12);
       }},
      {"torque_ripple",
       [] {
         const Physics p = with("torque_ripple", {0.2, 0.01, 0.0});
         PlantState<double> s;
         s.cart_m = 0.0025;
         s.cart_mps = 0.5;
         EXPECT_NEAR(p.motor_force(s, 4.0), 1.2 * 4.0 * 1.7189 - 1.44 * 0.5 * 7.682, 1e-12);
         EXPECT_EQ(p.cart_smooth_force(s, 4.0), p.motor_force(s, 4.0));
         s.cart_m = 0.0075;
         EXPECT_NEAR(p.motor_force(s, 4.0), 0.8 * 4.0 * 1.7189 - 0.64 * 0.5 * 7.682, 1e-12);
       }},
      {"voltage_saturation",
       [] {
         const Physics p = with("voltage_saturation", {10.0});
         EXPECT_EQ(p.actuate(12.0), 10.0);
         EXPECT_EQ(p.actuate(-12.0), -10.0);
         EXPECT_EQ(p.actuate(3.0), 3.0);
       }},
      {"voltage_dead_zone",
       [] {
         const Physics p = with("voltage_dead_zone", {0.5});
         EXPECT_EQ(p.actuate(0.4), 0.0);
         EXPECT_EQ(p.actuate(2.0), 1.5);
         EXPECT_EQ(p.actuate(-2.0), -1.5);
       }},
      {"voltage_gain", [] { EXPECT_DOUBLE_EQ(with("voltage_gain", {0.9}).actuate(2.0), 1.8); }},
      {"voltage_offset", [] { EXPECT_DOUBLE_EQ(with("voltage_offset", {0.2}).actuate(0.0), 0.2); }},
      {"input_delay", [] { EXPECT_EQ(with("input_delay", {0.004}).input_delay_s(), 0.004); }},
      {"motor_lag", [] { EXPECT_EQ(with("motor_lag", {0.01}).motor_time_constant_s(), 0.01); }},
      {"pivot_viscous_friction",
       [] { EXPECT_DOUBLE_EQ(with("pivot_viscous_friction", {0.002}).pivot_smooth_torque(-3.0), 0.006); }},
      {"pivot_coulomb_friction",
       [] {
         EXPECT_EQ(with("pivot_coulomb_friction", {0.003}).pivot_dry_level(), 0.003);
         EXPECT_TRUE(with("pivot_coulomb_friction", {0.003}).pivot_can_stick());
       }},
      {"pivot_quadratic_drag",
       [] { EXPECT_DOUBLE_EQ(with("pivot_quadratic_drag", {0.001}).pivot_smooth_torque(-3.0), 0.009); }},
      {"flexible_rod",
       [] {
         Plant plant = paper_plant();
         plant.set("flexible_rod", {0.4, 8.0, 0.1});
         const Physics p(make_model<double>(plant));
         EXPECT_TRUE(p.has_attached_mass());
         const PlantState<double> s{0.0, 0.4, 0.3, 1.7, 0.0, 0.0, 0.02, -0.3};
         expect_equations_of_a_bending_rod(plant, s, p.derivative(s, 1.0, {}));
       }},
      {"angle_offset",
       [] {
         EXPECT_DOUBLE_EQ(shown(with("angle_offset", {0.01})).theta_rad, 0.21);
         Plant plant = paper_plant();  // the scale comes first: measured = scale x true + offset
         plant.set("angle_offset", {0.01});
         plant.set("angle_scale", {2.0});
         EXPECT_DOUBLE_EQ(shown(Physics(make_model<double>(plant))).theta_rad, 0.41);
       }},
      {"backlash",
       [] {
         Plant plant = paper_plant();
         plant.set("backlash", {2e-3, 0.2, 1e4, 5.0});
         plant.pendulum.reset();
         const Physics p(make_model<double>(plant));
         EXPECT_TRUE(p.has_attached_mass());
         PlantState<double> s;
         s.cart_mps = 0.2;
         s.attached_mps = 0.1;
         const double motor_n = 3.0 * 1.7189 - 7.682 * 0.3, motor_kg = 0.2 * 0.815;
         EXPECT_NEAR(p.derivative(s, 3.0, {}).cart_mps, 0.0, 1e-12);  // in the gap
         EXPECT_NEAR(p.derivative(s, 3.0, {}).attached_mps, motor_n / motor_kg, 1e-12);
         s.attached_m = 1.2e-3;
         const double flank_n = 1e4 * 0.2e-3 * (1.0 + 5.0 * 0.1);
         const double cart_mps2 = flank_n / (0.8 * 0.815);
         EXPECT_NEAR(p.derivative(s, 3.0, {}).cart_mps, cart_mps2, 1e-12);
         EXPECT_NEAR(p.derivative(s, 3.0, {}).attached_mps, (motor_n - flank_n) / motor_kg - cart_mps2, 1e-9);
         s.attached_mps = -0.3;  // leaves quickly: a flank does not pull
         EXPECT_NEAR(p.derivative(s, 0.0, {}).cart_mps, 0.0, 1e-12);
       }},
      {"drive_compliance",
       [] {
         PlantState<double> s;
         s.cart_m = 0.1;
         s.cart_mps = 0.5;
         s.motor_v = 4.0;
         const double force = 4.0 * 1.7189 - 0.5 * 7.682;
         EXPECT_DOUBLE_EQ(with("drive_compliance", {1e-3}).measure(s).cart_m, 0.1 + 1e-3 * force);
       }},
      {"encoder_eccentricity",
       [] {
         constexpr double turn_m = 0.4, radius_m = 0.4 / (2.0 * std::numbers::pi);
         const Physics p = with("encoder_eccentricity", {0.03, turn_m, 0.0});
         EXPECT_NEAR(shown(p).cart_m, 0.1 + 0.03 * radius_m, 1e-15);  // a quarter of a turn
         const Physics shifted = with("encoder_eccentricity", {0.03, turn_m, 0.5});
         EXPECT_EQ(shifted.measure({}).cart_m, 0.0);
       }},
      {"lost_counts",
       [] {
         const Physics p = with("lost_counts", {0.5, 0.4});
         EXPECT_TRUE(p.loses_counts());
         for (const auto& [cart_mps, counted_mps] :
              {std::pair{0.3, 0.3}, std::pair{0.8, 0.6}, std::pair{-0.8, -0.6}}) {
           PlantState<double> s;
           s.cart_mps = cart_mps;
           EXPECT_DOUBLE_EQ(p.derivative(s, 0.0, {}).cart_m, counted_mps) << cart_mps;
         }
       }},
      {"cart_scale", [] { EXPECT_DOUBLE_EQ(shown(with("cart_scale", {1.02})).cart_m, 0.102); }},
      {"angle_scale", [] { EXPECT_DOUBLE_EQ(shown(with("angle_scale", {0.98})).theta_rad, 0.196); }},
      {"cart_mass", [] { EXPECT_DOUBLE_EQ(with("cart_mass", {1.1}).base().cart_mass_kg, 1.1 * 0.815); }},
      {"pendulum_mass",
       [] {
         const Physics p = with("pendulum_mass", {1.1});
         EXPECT_DOUBLE_EQ(p.base().pendulum_mass_kg, 1.1 * 0.21);
         EXPECT_DOUBLE_EQ(p.base().inertia_about_pivot_kgm2,
                          1.1 * paper_plant().pendulum->inertia_about_pivot_kgm2());
       }},
      {"pendulum_length",
       [] {
         const Physics p = with("pendulum_length", {1.1});
         EXPECT_DOUBLE_EQ(p.base().length_to_com_m, 1.1 * 0.305);
         EXPECT_NEAR(p.base().inertia_about_pivot_kgm2,
                     1.21 * paper_plant().pendulum->inertia_about_pivot_kgm2(), 1e-15);
       }},
      {"force_table",
       [] {
         const Physics p = with("force_table", {0.0, -0.6, 0.6, 0, 0, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0});
         EXPECT_NEAR(cart_force(p, 0.3, 0.1), 0.5, 1e-12);
         EXPECT_EQ(cart_force(p, 0.3, 0.0), 0.0);
         EXPECT_NEAR(cart_force(p, 0.3, 0.05), 0.5 * 0.5625, 1e-12);
       }},
      {"back_emf", [] { EXPECT_DOUBLE_EQ(with("back_emf", {0.9}).base().back_emf_n_per_mps, 0.9 * 7.682); }},
  };
  return all;
}

class Effect : public testing::TestWithParam<std::size_t> {};

TEST_P(Effect, GivesItsKnownAnswer) {
  const std::string kind(effect_registry()[GetParam()].kind);
  ASSERT_TRUE(answers().contains(kind)) << "no known answer for " << kind;
  answers().at(kind)();
}

/// At its neutral values an effect changes nothing.
TEST_P(Effect, IsNotThereAtItsNeutralValue) {
  const EffectInfo& info = effect_registry()[GetParam()];
  if (!std::isfinite(info.parameters[0].neutral) || info.kind == "motor_lag") return;
  Plant plant = paper_plant();
  std::array<double, max_effect_parameters> values{};
  for (std::size_t i = 0; i < info.parameters.size(); ++i)
    values[i] =
        std::isfinite(info.parameters[i].neutral) ? info.parameters[i].neutral : info.parameters[i].typical;
  plant.set(GetParam(), std::span<const double>(values.data(), info.parameters.size()));
  const Physics bare(make_model<double>(paper_plant())), same(make_model<double>(plant));
  PlantState<double> s{0.1, 0.2, 0.3, -0.4, 0.0, 0.0};
  const auto a = bare.derivative(s, bare.actuate(2.0), {Contact::slip_forward, Contact::slip_backward});
  const auto b = same.derivative(s, same.actuate(2.0), {Contact::slip_forward, Contact::slip_backward});
  EXPECT_DOUBLE_EQ(a.cart_mps, b.cart_mps);
  EXPECT_DOUBLE_EQ(a.theta_radps, b.theta_radps);
  EXPECT_DOUBLE_EQ(bare.measure(s).theta_rad, same.measure(s).theta_rad);
  EXPECT_DOUBLE_EQ(bare.measure(s).cart_m, same.measure(s).cart_m);
  EXPECT_EQ(same.input_delay_s(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(All, Effect, testing::Range(std::size_t{0}, effect_count), [](const auto& effect) {
  return std::string(effect_registry()[effect.param].kind);
});

TEST(Registry, IsWhole) {
  EXPECT_EQ(effect_count, 38u);
  std::set<std::string_view> kinds;
  std::size_t offset = 0;
  for (std::size_t i = 0; i < effect_count; ++i) {
    const EffectInfo& info = effect_registry()[i];
    EXPECT_TRUE(kinds.insert(info.kind).second) << info.kind;
    EXPECT_EQ(effect_number(info.kind), i);
    EXPECT_EQ(effect_parameter_offset(i), offset);
    offset += info.parameters.size();
    EXPECT_FALSE(info.equation.empty() || info.meaning.empty()) << info.kind;
    ASSERT_FALSE(info.parameters.empty()) << info.kind;
    ASSERT_LE(info.parameters.size(), max_effect_parameters) << info.kind;
    for (const ParameterInfo& parameter : info.parameters) {
      EXPECT_FALSE(parameter.name.empty() || parameter.unit.empty() || parameter.meaning.empty())
          << info.kind;
      EXPECT_TRUE(parameter.range.contains(parameter.typical)) << info.kind << " " << parameter.name;
    }
  }
  EXPECT_EQ(offset, all_parameter_count);
  EXPECT_EQ(effect_number("no_such_effect"), effect_count);
}

TEST(Actuator, StagesComeInTheInterfacesOrder) {
  Plant plant = paper_plant();
  plant.set("voltage_saturation", {5.0});
  plant.set("voltage_offset", {0.3});
  plant.set("voltage_gain", {2.0});
  plant.set("voltage_dead_zone", {0.5});
  const Physics p(make_model<double>(plant));
  EXPECT_DOUBLE_EQ(p.actuate(1.5), 2.0 * (1.5 - 0.5) + 0.3);
  EXPECT_DOUBLE_EQ(p.actuate(0.2), 0.3);
  EXPECT_DOUBLE_EQ(p.actuate(9.0), 5.0);
}

}  // namespace
}  // namespace upright
