// A mass with a motion of its own on the cart is found where the runs of a rig show one, on a light and on a
// heavy rig. One that is in the plant file already stays the only one.
#include "diagnosis/attached_mass_search.hpp"

#include <gtest/gtest.h>

#include "blind_case.hpp"
#include "diagnosis/candidates.hpp"
#include "diagnosis/plant_scale.hpp"
#include "named_effects.hpp"

namespace upright {
namespace {

TEST(AttachedMassSearch, FindsASprungMass) {
  const auto values = {0.1, 4.0, 0.08};
  Plant truth = cart_with_friction();
  truth.set("sprung_mass", values);
  expect_values(only_named(cart_with_friction(), truth), "sprung_mass", values, 0.1);
}

TEST(AttachedMassSearch, FindsAFlexibleRod) {
  const auto values = {0.5, 4.0, 0.05};
  Plant truth = cart_with_pendulum();
  truth.set("flexible_rod", values);
  expect_values(only_named(cart_with_pendulum(), truth), "flexible_rod", values, 0.1);
}

TEST(AttachedMassSearch, FindsBacklash) {
  Plant truth = cart_with_friction();
  truth.set("backlash", {1e-3, 0.25, 3e4, 10.0});
  expect_values(only_named(cart_with_friction(), truth), "backlash", {1e-3, 0.25}, 0.1);
}

TEST(AttachedMassSearch, FindsASprungMassOnAHeavyRig) {
  constexpr double factor = 85.0;
  Plant heavy = cart_with_friction();
  heavy.cart_mass_kg *= factor;
  heavy.motor = {factor * heavy.motor.force_per_volt_n, factor * heavy.motor.back_emf_n_per_mps};
  heavy.set("viscous_friction", {3.0 * factor});
  heavy.set("coulomb_friction", {0.4 * factor});
  Plant truth = heavy;
  truth.set("sprung_mass", {0.1 * factor, 4.0, 0.08});
  expect_values(only_named(heavy, truth), "sprung_mass", {0.1 * factor, 4.0, 0.08}, 0.1);
}

std::set<std::string> named_in(blind::Request request, blind::Size size) {
  request.size = size;
  request.max_samples = 6000.0;
  const blind::Case blind = make_case(request);
  return named_effects(measure_all(blind), blind.believed);
}

/// A random force accounts for the swing of the first mass, so that nothing seems to be missing. On the
/// second rig, something is left beside the mass too.
TEST(AttachedMassSearch, NamesASprungMassThatIsCertain) {
  for (const std::uint64_t number : {12, 2}) {
    blind::Request request;
    request.hidden = {"sprung_mass"};
    request.seed = blind::seed_of_case(20270401, number);
    const blind::Size size = number == 12 ? blind::Size::weak : blind::Size::strong;
    EXPECT_EQ(named_in(request, size), std::set<std::string>{"sprung_mass"}) << number;
  }
}

/// Plain simulations are hardly better with the mass, since a random force moves them too.
TEST(AttachedMassSearch, NamesASprungMassBesideADisturbance) {
  const auto request = blind::laboratory_request(blind::seed_of_case(20270402, 23), {"sprung_mass"});
  EXPECT_EQ(named_in(request, blind::Size::weak), std::set<std::string>{"sprung_mass"});
}

TEST(AttachedMassSearch, BeginsWithinItsLimits) {
  Plant plant = cart_with_pendulum();
  const std::vector<Measurement> runs = three_runs({.plant = plant}, 6.0, 1);
  const SelectionPolicy policy = policy_for(plant);
  const DataRange range = range_of(runs, plant, policy.excitation);
  const std::vector<std::size_t> masses = attached_mass_candidates(plant, range);
  ASSERT_EQ(masses.size(), 3u);
  for (const std::size_t effect : masses) {
    const std::vector<FreeParameter> free = free_parameters(effect, range, policy.prior);
    const auto starts = attached_mass_starts(effect, range, policy.prior);
    ASSERT_FALSE(starts.empty());
    for (const std::vector<double>& start : starts)
      for (std::size_t i = 0; i < free.size(); ++i) {
        EXPECT_GT(start[i], free[i].low) << kind_of(effect) << i;
        EXPECT_LT(start[i], free[i].high) << kind_of(effect) << i;
      }
  }
  for (const std::size_t usual : candidate_effects(plant, range)) EXPECT_FALSE(attaches_mass(usual));
  plant.set("sprung_mass", {0.1, 4.0, 0.08});
  EXPECT_TRUE(attached_mass_candidates(plant, range).empty());
}

}  // namespace
}  // namespace upright
