// Closed-form answers of a counter that loses counts while the cart is fast, on both engines.
#include <gtest/gtest.h>

#include <utility>

#include "plants.hpp"
#include "sim/cvode_engine.hpp"
#include "upright/sim/event_engine.hpp"

namespace upright {
namespace {

/// The paper's cart alone, with a counter that loses counts.
Plant cart_with_counter(double share, double speed_mps) {
  Plant plant = test::paper_plant();
  plant.pendulum.reset();
  plant.set("lost_counts", {share, speed_mps});
  return plant;
}

template <class Engine>
class LostCounts : public testing::Test {};

using Engines = testing::Types<EventEngine<double>, CvodeEngine>;
TYPED_TEST_SUITE(LostCounts, Engines);

// At a constant acceleration a, the cart is (v - v1)^2 / (2 a) ahead of its counter, and a little more as the
// loss sets in early: the integral of (u + 1)^3 (3 - u) / 16 from -1 to 1 is 0.6, that of max(u, 0) is 0.5,
// and u is 1 a tenth of v1 beyond v1.
TYPED_TEST(LostCounts, AreMissingOfTheWayOfACartThatAccelerates) {
  constexpr double v1_mps = 0.5, volts = 1.0, duration_s = 0.5;
  for (const double share : {1.0, 0.3, 2.0})
    for (const double direction : {1.0, -1.0}) {
      Plant plant = cart_with_counter(share, v1_mps);
      plant.motor.back_emf_n_per_mps = 0.0;
      TypeParam e(make_model<double>(plant), EngineOptions{});
      e.start({0.1});
      for (int k = 0; k < 500; ++k) e.advance(duration_s / 500.0, direction * volts);
      const double a = volts * plant.motor.force_per_volt_n / plant.cart_mass_kg, v = a * duration_s;
      const double lost_m = share / a * (0.5 * (v - v1_mps) * (v - v1_mps) + 0.1 * 0.01 * v1_mps * v1_mps);
      ASSERT_GT(v, 1.5 * v1_mps);
      EXPECT_NEAR(e.state().cart_mps, direction * v, 1e-8) << share;
      EXPECT_NEAR(e.outputs().cart_m, 0.1 + direction * (0.5 * v * duration_s - lost_m), 5e-8) << share;
    }
}

// What is lost on a fast way out does not come back on a slow way home.
TYPED_TEST(LostCounts, MoveTheZeroOfThePosition) {
  const auto shown = [](double share) {
    TypeParam e(make_model<double>(cart_with_counter(share, 0.5)), EngineOptions{});
    e.start({});
    const auto drive = [&](double volts, double duration_s) {
      for (int k = 0; k < duration_s * 1000.0; ++k) e.advance(1e-3, volts);
      return e.outputs().cart_m;
    };
    drive(5.0, 0.5);
    const double out_m = drive(0.0, 0.5);
    return std::pair{out_m, drive(-1.0, 2.0)};
  };
  const auto [out_m, home_m] = shown(0.0);
  const auto [shown_out_m, shown_home_m] = shown(0.6);
  EXPECT_GT(out_m - shown_out_m, 0.05);
  EXPECT_NEAR(home_m - shown_home_m, out_m - shown_out_m, 1e-8);
}

}  // namespace
}  // namespace upright
