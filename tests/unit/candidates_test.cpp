// The candidate effects and what is believed of their parameters.
#include "diagnosis/candidates.hpp"

#include <gtest/gtest.h>

#include <string>

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

}  // namespace
}  // namespace upright
