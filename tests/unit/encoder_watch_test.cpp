#include "control/encoder_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/yaml_keys.hpp"

namespace upright {
namespace {

constexpr double period_s = 0.002;

/// Feeds periods until an encoder is found stuck; returns when, or the end.
template <class Make>
double found_after_s(EncoderWatch& watch, double until_s, StuckEncoder expected, Make make) {
  for (std::uint64_t tick = 0; static_cast<double>(tick) * period_s < until_s; ++tick) {
    WatchedPeriod period = make(tick);
    period.tick = tick;
    period.time_s = static_cast<double>(tick) * period_s;
    const StuckEncoder found = watch.step(period);
    if (found == StuckEncoder::none) continue;
    EXPECT_EQ(found, expected);
    return period.time_s;
  }
  return until_s;
}

constexpr double m_per_count = 2.27485e-5, rad_per_count = 1.5339808e-3;

/// An IP02 with up to 2 N of dry friction, an actuator that is up to 30 ms late, and each of Quanser's
/// pendulums.
const EncoderAssumptions ip02{{0.1, 1.4}, 0.03, 1.1, 8.0, 5e-5, 0.7, 0.1};

EncoderWatch ip02_watch() {
  return EncoderWatch(ip02, m_per_count, rad_per_count);
}

TEST(EncoderWatch, FindsACartThatDoesNotCountUnderAStrongVoltage) {
  EncoderWatch watch = ip02_watch();
  const double found_s = found_after_s(watch, 5.0, StuckEncoder::cart, [](std::uint64_t tick) {
    return WatchedPeriod{0, 0.0, 7, static_cast<std::int64_t>(tick), 0.0, 5.0};
  });
  EXPECT_LT(found_s, 0.15);
  EXPECT_EQ(watch.silent_since(StuckEncoder::cart), 1u);
}

TEST(EncoderWatch, LetsACartRestBelowItsBreakaway) {
  EncoderWatch watch = ip02_watch();
  const double breakaway_v = ip02.breakaway_v.high;
  const double found_s = found_after_s(watch, 60.0, StuckEncoder::none, [&](std::uint64_t) {
    return WatchedPeriod{0, 0.0, 7, 3, 0.0, breakaway_v};
  });
  EXPECT_EQ(found_s, 60.0);
}

TEST(EncoderWatch, TakesABriefPulseOfAStrongVoltageForNoProof) {
  EncoderWatch watch = ip02_watch();
  const double found_s = found_after_s(watch, 0.5, StuckEncoder::none, [](std::uint64_t tick) {
    return WatchedPeriod{0, 0.0, 7, 3, 0.0, tick == 10 ? 15.0 : 0.0};
  });
  EXPECT_EQ(found_s, 0.5);
}

TEST(EncoderWatch, FindsAStuckPendulumEncoderOverAShakenCart) {
  EncoderWatch watch = ip02_watch();
  const double found_s = found_after_s(watch, 5.0, StuckEncoder::pendulum, [](std::uint64_t tick) {
    const double cart_m = 0.02 * std::sin(0.05 * static_cast<double>(tick));
    return WatchedPeriod{0, 0.0, static_cast<std::int64_t>(tick), 3, cart_m, 0.0};
  });
  EXPECT_LT(found_s, 0.2);
}

TEST(EncoderWatch, LetsACartAccelerateUnderALeaningPendulum) {
  EncoderWatch watch = ip02_watch();
  const double found_s = found_after_s(watch, 2.0, StuckEncoder::none, [](std::uint64_t tick) {
    const double t = static_cast<double>(tick) * period_s;
    return WatchedPeriod{0, 0.0, static_cast<std::int64_t>(tick), 3, 0.3 * t + 0.25 * t * t, 0.0};
  });
  EXPECT_EQ(found_s, 2.0);
}

TEST(EncoderWatch, ForgetsOnReset) {
  EncoderWatch watch = ip02_watch();
  for (std::uint64_t tick = 0; tick < 5000; ++tick) {
    if (tick % 20 == 0) watch.reset();
    ASSERT_EQ(watch.step({tick, static_cast<double>(tick) * period_s, 7, 3, 0.0, 10.0}), StuckEncoder::none);
  }
}

TEST(EncoderWatch, AssumesOfAPlantWhatItsEffectsImply) {
  Plant plant;
  plant.cart_mass_kg = 0.8;
  plant.motor = {2.0, 8.0};
  plant.set("coulomb_friction", {1.0});
  plant.set("input_delay", {0.004});
  plant.set("motor_lag", {0.006});
  const EncoderAssumptions a = encoder_assumptions(plant, 0.4, 15.0, 0.5);
  EXPECT_NEAR(a.breakaway_v.low, 0.5 / 1.5, 1e-9);
  EXPECT_NEAR(a.breakaway_v.high, 0.5 * 1.5, 1e-9);
  EXPECT_NEAR(a.acceleration_mps2_per_v, 2.0 / 0.8 / 1.5, 1e-9);
  EXPECT_NEAR(a.damping_v_per_mps, 1.5 * 8.0 / 2.0, 1e-9);
  EXPECT_GE(a.largest_lag_s, 1.5 * 0.010);
}

TEST(EncoderWatch, AssumesFrictionThatIsLargerWhenColdOrUnderLoad) {
  Plant plant;
  plant.cart_mass_kg = 0.8;
  plant.motor = {2.0, 8.0};
  plant.set("coulomb_friction", {1.0});
  plant.set("warming_friction", {0.6, 20.0});
  plant.set("load_dependent_friction", {0.2});
  const EncoderAssumptions a = encoder_assumptions(plant, 0.4, 15.0, 0.5);
  EXPECT_NEAR(a.breakaway_v.low, 1.0 / (2.0 * 0.8) / 1.5, 1e-9);
  EXPECT_NEAR(a.breakaway_v.high, 1.6 / (2.0 * 0.8) * 1.5, 1e-9);
  EXPECT_NEAR(a.acceleration_mps2_per_v, 2.0 * 0.8 / 0.8 / 1.5, 1e-9);
}

TEST(EncoderWatch, AssumesTheMotorWhereItIsWeakest) {
  Plant plant;
  plant.cart_mass_kg = 0.8;
  plant.motor = {2.0, 8.0};
  plant.set("coulomb_friction", {1.0});
  plant.set("torque_ripple", {0.2, 0.1, 0.7});
  const EncoderAssumptions a = encoder_assumptions(plant, 0.4, 15.0, 0.5);
  EXPECT_NEAR(a.acceleration_mps2_per_v, 2.0 * 0.8 / 0.8 / 1.5, 1e-3);
  EXPECT_NEAR(a.breakaway_v.low, 1.0 / (2.0 * 1.2) / 1.5, 1e-3);
  EXPECT_NEAR(a.breakaway_v.high, 1.0 / (2.0 * 0.8) * 1.5, 1e-3);
}

StatedAssumptions stated_in(const std::string& section) {
  const YamlMap document = YamlMap::from_text("encoder_watch: " + section, "rig.yaml");
  YamlKeyReader reader(document.map("encoder_watch"));
  StatedAssumptions stated;
  encoder_assumption_keys(reader, stated);
  return stated;
}

TEST(EncoderWatch, ReadsBackItsAssumptions) {
  EncoderAssumptions a = ip02;
  a.breakaway_v = {0.125, 0.75};
  a.largest_lag_s = 0.01;
  const EncoderAssumptions again = encoder_assumptions(stated_in(encoder_assumptions_text(a)), 0.4);
  EXPECT_EQ(encoder_assumptions_text(again), encoder_assumptions_text(a));
}

TEST(EncoderWatch, AssumesAnIp02WithoutAPlantAndBounds) {
  EXPECT_EQ(encoder_assumptions_text(encoder_assumptions(StatedAssumptions{}, 0.4)),
            encoder_assumptions_text(ip02));
}

TEST(EncoderWatch, NamesTheBoundsThatAreNotStated) {
  EXPECT_EQ(missing_assumptions({}), (std::vector<std::string>{"breakaway_v", "acceleration_mps2_per_v",
                                                               "damping_v_per_mps", "longest_pendulum_m"}));
  EXPECT_EQ(missing_assumptions(stated_in("{breakaway_v: {from: 1, to: 2}, damping_v_per_mps: 9}")),
            (std::vector<std::string>{"acceleration_mps2_per_v", "longest_pendulum_m"}));
  const StatedAssumptions enough = stated_in(
      "{breakaway_v: {from: 1, to: 2}, acceleration_mps2_per_v: 3, damping_v_per_mps: 4, "
      "longest_pendulum_m: 5}");
  EXPECT_TRUE(missing_assumptions(enough).empty());
  EXPECT_EQ(encoder_assumptions_text(encoder_assumptions(enough, 4.0)),
            "{breakaway_v: {from: 1.0, to: 2.0}, largest_lag_s: 0.03, acceleration_mps2_per_v: 3.0, "
            "damping_v_per_mps: 4.0, unseen_travel_m: 5e-04, longest_pendulum_m: 5.0, "
            "pivot_friction_mps2: 0.1}");
}

TEST(EncoderWatch, WidensOnlyWhatAFileStates) {
  const EncoderAssumptions wide = widened(ip02, stated_in("{largest_lag_s: 0.06, damping_v_per_mps: 2}"));
  EncoderAssumptions expected = ip02;
  expected.largest_lag_s = 0.06;
  EXPECT_EQ(encoder_assumptions_text(wide), encoder_assumptions_text(expected));
}

TEST(EncoderWatch, AccusesNobodyWithoutAssumptions) {
  EncoderWatch watch(EncoderAssumptions{}, m_per_count, rad_per_count);
  const double found_s = found_after_s(watch, 20.0, StuckEncoder::none, [](std::uint64_t tick) {
    const double cart_m = 0.02 * std::sin(0.05 * static_cast<double>(tick));
    return WatchedPeriod{0, 0.0, 7, 3, cart_m, 15.0};
  });
  EXPECT_EQ(found_s, 20.0);
}

/// A cart and a pendulum that follow what the watch takes for granted: however the voltage goes, nobody is
/// stuck.
TEST(EncoderWatch, NeverAccusesEncodersThatCount) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise;
  for (int run = 0; run < 20; ++run) {
    EncoderWatch watch = ip02_watch();
    double voltage = 0.0, velocity = 0.0, cart_m = 0.0, theta = 0.01, rate = 0.0;
    for (std::uint64_t tick = 0; tick < 20'000; ++tick) {
      constexpr double breakaway_v = 0.5, v_per_mps = 6.2, mps2_per_v = 1.58, length_m = 0.407;
      voltage = std::clamp(voltage + noise(random), -10.0, 10.0);
      const bool sticks = velocity == 0.0 && std::abs(voltage) < breakaway_v;
      const double drive = voltage - v_per_mps * velocity - std::copysign(breakaway_v, velocity);
      const double acceleration = sticks ? 0.0 : mps2_per_v * drive;
      velocity += acceleration * period_s;
      cart_m += velocity * period_s;
      rate += (9.8 * theta - acceleration) / length_m * period_s;
      theta = std::remainder(theta + rate * period_s, 6.283185307179586);
      const auto cart = static_cast<std::int64_t>(std::floor(cart_m / 2.27485e-5));
      const auto pendulum = static_cast<std::int64_t>(std::floor(theta * 651.9));
      ASSERT_EQ(watch.step({tick, static_cast<double>(tick) * period_s, cart, pendulum, cart_m, voltage}),
                StuckEncoder::none)
          << run << " " << tick;
    }
  }
}

}  // namespace
}  // namespace upright
