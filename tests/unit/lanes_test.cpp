// The lanes' elementary functions, in the registers that the build uses.
#include "sim/loop/lanes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "upright/model/effects/force_table.hpp"

namespace upright {
namespace {

TEST(Lanes, FunctionsAreThoseOfTheLibrary) {
  std::mt19937_64 random(1);
  for (const double scale : {1e-6, 0.1, 1.0, 3.0, 40.0}) {
    std::uniform_real_distribution<double> within(-scale, scale);
    for (int repeat = 0; repeat < 200; ++repeat) {
      std::array<double, lane_count> x;
      for (double& value : x) value = within(random);
      const Lanes lanes = Lanes::load(x.data());
      const auto s = sin(lanes).values(), c = cos(lanes).values(), e = exp(lanes).values(),
                 t = tanh(lanes).values(), q = (Lanes(1.0) / lanes).values();
      for (std::size_t i = 0; i < lane_count; ++i) {
        EXPECT_NEAR(s[i], std::sin(x[i]), 1e-11);
        EXPECT_NEAR(c[i], std::cos(x[i]), 1e-11);
        EXPECT_NEAR(e[i] / std::exp(x[i]), 1.0, 2e-12);
        EXPECT_NEAR(t[i], std::tanh(x[i]), 1e-12);
        EXPECT_NEAR(q[i] * x[i], 1.0, 1e-12);
      }
    }
  }
}

TEST(Lanes, ForceTableIsThatOfSingleRuns) {
  using effects::ForceTable;
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::array<double, std::size(ForceTable::parameters)> p{ForceTable::velocity, -0.8, 0.7};
  std::generate(p.begin() + ForceTable::first_node, p.end(), [&] { return any(random); });
  std::array<Lanes, p.size()> on_lanes;
  for (std::size_t i = 0; i < p.size(); ++i) on_lanes[i] = p[i];
  for (int repeat = 0; repeat < 200; ++repeat) {
    std::array<double, lane_count> v;
    for (double& value : v) value = any(random);
    const auto force = ForceTable::cart_force(on_lanes.data(), Lanes(0.0), Lanes::load(v.data())).values();
    for (std::size_t i = 0; i < lane_count; ++i)
      EXPECT_NEAR(force[i], ForceTable::cart_force(p.data(), 0.0, v[i]), 1e-12);
  }
}

}  // namespace
}  // namespace upright
