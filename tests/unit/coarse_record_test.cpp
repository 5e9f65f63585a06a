// Thinned records: what is left of the samples, the voltage and the gaps.
#include "estimation/coarse_record.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "estimation/segment_start.hpp"

namespace upright {
namespace {

constexpr double period_s = 4e-3;
constexpr Thinning thinning{period_s, 0.01};

Plant cart_alone() {
  Plant plant;
  plant.cart_mass_kg = 1.0;
  plant.motor = {1.5, 6.6};
  return plant;
}

/// A second at 1 kHz under this voltage.
template <class Voltage>
Measurement record(const Voltage& voltage) {
  Measurement run;
  for (int k = 0; k < 1000; ++k) {
    run.time_s.push_back(1e-3 * k);
    run.voltage_v.push_back(voltage(run.time_s.back()));
    run.cart_m.push_back(0.1 * std::sin(run.time_s.back()));
  }
  run.known_cart_noise_m = 1e-5;
  return run;
}

/// A voltage that changes from sample to sample.
double jitter_v(double t) {
  return 2.0 * std::sin(6.0 * t) + (std::lround(1e3 * t) % 2 == 0 ? 0.5 : -0.5);
}

TEST(CoarseRecord, KeepsEveryFourthSampleAndTheMeanVoltage) {
  const std::vector<Measurement> runs = {record(jitter_v)};
  const std::vector<Measurement> coarse = coarse_runs(runs, cart_alone(), thinning);
  ASSERT_NEAR(coarse[0].size(), 250.0, 2.0);
  double impulse = 0.0, coarse_impulse = 0.0;
  for (std::size_t k = 0; k + 1 < runs[0].size(); ++k) impulse += runs[0].voltage_v[k] * 1e-3;
  for (std::size_t i = 0; i + 1 < coarse[0].size(); ++i)
    coarse_impulse += coarse[0].voltage_v[i] * (coarse[0].time_s[i + 1] - coarse[0].time_s[i]);
  EXPECT_NEAR(coarse_impulse, impulse, 1e-12);
  EXPECT_EQ(coarse[0].time_s.back(), runs[0].time_s.back());
  for (std::size_t i = 0; i < coarse[0].size(); ++i)
    EXPECT_EQ(coarse[0].cart_m[i],
              runs[0].cart_m[static_cast<std::size_t>(std::lround(1e3 * coarse[0].time_s[i]))]);
}

TEST(CoarseRecord, HasOneCommandForEachChangeOfTheVoltage) {
  const auto square = [](double t) { return t < 0.4985 ? -8.0 : 8.0; };
  const Measurement coarse = coarse_runs({record(square)}, cart_alone(), thinning)[0];
  EXPECT_EQ(coarse.commands.size(), coarse.size() + 1);
  const auto jump = std::find_if(coarse.commands.begin(), coarse.commands.end(),
                                 [](const VoltageCommand& c) { return c.voltage_v > 0.0; });
  ASSERT_NE(jump, coarse.commands.end());
  EXPECT_NEAR(jump->time_s, 0.499, 1e-12);
  for (const VoltageCommand& command : coarse.commands) EXPECT_EQ(std::abs(command.voltage_v), 8.0);
}

// With an input delay and a motor lag, from a start within the record, on a cart that sticks and slips.
TEST(CoarseRecord, DrivesAPlantAsTheWholeRecordDoes) {
  Plant plant = cart_alone();
  plant.set("coulomb_friction", {1.5});
  plant.set("input_delay", {2.7e-3});
  plant.set("motor_lag", {3e-3});
  const std::vector<Measurement> whole = {record(jitter_v)}, coarse = coarse_runs(whole, plant, thinning);
  const std::size_t first = 30;
  const auto place_of = [&](const Measurement& run) {
    return static_cast<std::size_t>(
        std::lower_bound(run.time_s.begin(), run.time_s.end(), coarse[0].time_s[first]) - run.time_s.begin());
  };
  const auto simulated = [&](const Measurement& run) {
    const Segment segment{0, place_of(run), run.size() - 1};
    Simulator<double> simulator(make_model<double>(plant), {}, max_commands(run, segment));
    start_segment(simulator, run, segment, PlantState<double>{0.0, 0.0, 0.2, 0.0});
    std::vector<double> cart_m;
    for (std::size_t k = segment.first; k <= segment.last; ++k) {
      simulator.advance_to(run.time_s[k]);
      if (std::binary_search(coarse[0].time_s.begin(), coarse[0].time_s.end(), run.time_s[k]))
        cart_m.push_back(simulator.engine().state().cart_m);
      command_from(k, run, simulator);
    }
    EXPECT_GT(simulator.engine().event_count(), 3u);
    return cart_m;
  };
  const std::vector<double> of_whole = simulated(whole[0]), of_coarse = simulated(coarse[0]);
  ASSERT_EQ(of_whole.size(), of_coarse.size());
  for (std::size_t i = 0; i < of_whole.size(); ++i) ASSERT_NEAR(of_whole[i], of_coarse[i], 1e-9) << i;
}

TEST(CoarseRecord, TheMeanVoltageTakesASlidingCartToTheSamePlace) {
  Measurement run = record([](double t) { return 2.0 * std::sin(6.0 * t); });
  for (std::size_t k = 0; k < run.size(); ++k) run.cart_m[k] = 0.5 * run.time_s[k];
  const Measurement coarse = coarse_runs({run}, cart_alone(), thinning)[0];
  EXPECT_LT(coarse.commands.size(), run.size() / 3);
  const double per_volt_mps2 = cart_alone().motor.force_per_volt_n / cart_alone().cart_mass_kg;
  const auto place_m = [&](const Measurement& of, double until_s) {
    double x = 0.0, v = 0.0;
    for (std::size_t k = 0; k + 1 < of.size() && of.time_s[k] < until_s; ++k) {
      const double held_s = of.time_s[k + 1] - of.time_s[k], a = per_volt_mps2 * of.voltage_v[k];
      x += v * held_s + 0.5 * a * held_s * held_s;
      v += a * held_s;
    }
    return x;
  };
  // The mean over each period T moves a cart as the voltage itself does, but for T^2/12 times the change of
  // the voltage since the beginning.
  constexpr double swing_v = 4.0;
  const double shift_m = per_volt_mps2 * swing_v * period_s * period_s / 12.0;
  double largest_m = 0.0;
  for (const double time_s : coarse.time_s)
    largest_m = std::max(largest_m, std::abs(place_m(coarse, time_s) - place_m(run, time_s)));
  EXPECT_LT(largest_m, shift_m);
}

TEST(CoarseRecord, KeepsAllVoltagesWhereTheCartMayStick) {
  Measurement run = record(jitter_v);
  for (double& x : run.cart_m) x = 0.0;
  EXPECT_EQ(coarse_runs({run}, cart_alone(), thinning)[0].commands.size(), run.size());
}

TEST(CoarseRecord, KeepsAllVoltagesWhereTheMeanWouldMoveTheCart) {
  Measurement run = record(jitter_v);
  for (std::size_t k = 0; k < run.size(); ++k) run.cart_m[k] = 0.5 * run.time_s[k];
  EXPECT_EQ(coarse_runs({run}, cart_alone(), thinning)[0].commands.size(), run.size());
}

TEST(CoarseRecord, KeepsGaps) {
  Measurement run = record([](double) { return 1.0; });
  run.breaks = {503};
  const std::vector<Measurement> runs = {run};
  const std::vector<Measurement> coarse = coarse_runs(runs, cart_alone(), thinning);
  ASSERT_EQ(coarse[0].breaks.size(), 1u);
  EXPECT_EQ(coarse[0].time_s[coarse[0].breaks[0]], run.time_s[503]);
}

}  // namespace
}  // namespace upright
