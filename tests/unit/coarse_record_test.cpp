// Thinned records: what is left of the samples, the voltage and the gaps.
#include "estimation/coarse_record.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace upright {
namespace {

constexpr double period_s = 4e-3;

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

TEST(CoarseRecord, KeepsEveryFourthSampleAndTheMeanOfASlowVoltage) {
  const std::vector<Measurement> runs = {record([](double t) { return 2.0 * std::sin(6.0 * t); })};
  const std::vector<Measurement> coarse = coarse_runs(runs, cart_alone(), period_s);
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

TEST(CoarseRecord, KeepsTheSampleAtWhichTheVoltageJumps) {
  const auto square = [](double t) { return t < 0.4985 ? -8.0 : 8.0; };
  const Measurement coarse = coarse_runs({record(square)}, cart_alone(), period_s)[0];
  for (const double volts : coarse.voltage_v) EXPECT_EQ(std::abs(volts), 8.0);
}

TEST(CoarseRecord, KeepsGapsAndSegments) {
  Measurement run = record([](double) { return 1.0; });
  run.breaks = {503};
  const std::vector<Measurement> runs = {run};
  const std::vector<Measurement> coarse = coarse_runs(runs, cart_alone(), period_s);
  ASSERT_EQ(coarse[0].breaks.size(), 1u);
  EXPECT_EQ(coarse[0].time_s[coarse[0].breaks[0]], run.time_s[503]);
  const std::vector<Segment> segments =
      coarse_segments({{0, 0, 502}, {0, 503, 999}, {0, 100, 110}}, runs, coarse);
  ASSERT_EQ(segments.size(), 2u) << "too few samples are left of the third";
  EXPECT_EQ(coarse[0].time_s[segments[0].last], run.time_s[502]);
  EXPECT_EQ(coarse[0].time_s[segments[1].first], run.time_s[503]);
}

}  // namespace
}  // namespace upright
