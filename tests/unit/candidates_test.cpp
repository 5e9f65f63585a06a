// The candidate effects and what is believed of their parameters.
#include "diagnosis/candidates.hpp"

#include <gtest/gtest.h>

#include <string>

#include "diagnosis/plant_scale.hpp"
#include "upright/model/registry.hpp"

namespace upright {
namespace {

// A fit steps in units of a parameter's scale: a unit that is not recognised keeps the scale of a small cart.
TEST(Candidates, ForcesAndTorquesScaleWithTheRig) {
  DataRange large;
  large.largest_force_n = large.gravity_torque_nm = 1e8;
  large.largest_speed_mps = large.longest_travel_m = large.pendulum_rate_radps = 1.0;
  const PriorPolicy prior;
  for (std::size_t effect = 0; effect < effect_count; ++effect) {
    const EffectInfo& info = effect_registry()[effect];
    for (const FreeParameter& p : free_parameters(effect, large, prior)) {
      const ParameterInfo& parameter = info.parameters[p.index];
      if (!parameter.unit.starts_with("N")) continue;
      EXPECT_GT(p.scale, parameter.typical)
          << info.kind << " " << parameter.name << " [" << parameter.unit << "]";
    }
  }
}

// Encoder play had bristles of 480 times the critical damping: a fit followed them in tiny steps, for
// minutes.
TEST(Candidates, BristlesAreDampedCriticallyAtMost) {
  const std::size_t bristles = effect_number("bristle_friction");
  for (const double mass_kg : {0.3, 1.0, 90.0}) {
    Plant plant;
    plant.cart_mass_kg = mass_kg;
    plant.motor = {1.5 * mass_kg, 6.6 * mass_kg};
    const PriorPolicy prior = policy_for(plant).prior;
    DataRange range;
    range.cart_mass_kg = mass_kg;
    range.largest_force_n = 10.0 * mass_kg;
    range.longest_travel_m = 0.4;
    const std::vector<FreeParameter> free = free_parameters(bristles, range, prior);
    const double stiffness_n_per_m = free[0].high, damping_n_per_mps = free[1].high;
    EXPECT_DOUBLE_EQ(damping_n_per_mps * damping_n_per_mps, 4.0 * stiffness_n_per_m * mass_kg);
    for (const std::vector<double>& start : search_starts(bristles, range, prior, SearchBudget{})) {
      EXPECT_GT(start[1], free[1].low);
      EXPECT_LT(start[1], free[1].high);
    }
  }
}

}  // namespace
}  // namespace upright
