#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "upright/base/error.hpp"
#include "upright/control/controller.hpp"

namespace upright {
namespace {

ControlState state_of(double value) {
  return {value, 2.0 * value, 3.0 * value, 4.0 * value};
}

TEST(DelayLine, IsExactToTheSampleAtMultiplesOfThePeriod) {
  for (const int periods : {0, 1, 2, 7, 15, 100}) {
    DelayLine line(periods * 0.001, 0.001);
    ASSERT_TRUE(line.exact());
    ASSERT_EQ(line.whole_periods(), static_cast<std::size_t>(periods));
    line.start(state_of(0.0));
    for (int k = 1; k < 300; ++k) {
      line.push(state_of(k));
      EXPECT_EQ(line.delayed().cart_m, std::max(0, k - periods));
      EXPECT_EQ(line.delayed().pendulum_rate_radps, 4.0 * std::max(0, k - periods));
    }
  }
}

TEST(DelayLine, IsLinearInBetweenAndSaysSo) {
  DelayLine line(0.00325, 0.001);
  EXPECT_FALSE(line.exact());
  line.start(state_of(0.0));
  for (int k = 1; k < 50; ++k) line.push(state_of(k));
  EXPECT_NEAR(line.delayed().theta_rad, 2.0 * (49 - 3.25), 1e-12);
}

TEST(DelayLine, HoldsTheFirstStateBeforeThereAreData) {
  DelayLine line(0.0105, 0.001);
  line.start(state_of(5.0));
  for (int k = 0; k < 10; ++k) {
    EXPECT_EQ(line.delayed().cart_m, 5.0);
    line.push(state_of(-1.0));
  }
}

TEST(DelayLine, RefusesWhatItCannotHold) {
  EXPECT_THROW(DelayLine(-0.001, 0.001), ConfigError);
  EXPECT_THROW(DelayLine(NAN, 0.001), ConfigError);
  EXPECT_THROW(DelayLine(1e9, 0.001), ConfigError);
  EXPECT_THROW(DelayLine(0.1, 0.0), ConfigError);
}

EstimatorConfig filter(double cutoff_hz, double damping) {
  return {EstimatorKind::second_order_filter, cutoff_hz, damping};
}

/// The filter integrated in small steps over a position that is linear between samples.
double filtered_by_small_steps(const std::vector<double>& x, double period, double wc, double zeta) {
  double z = x[0], v = 0.0;
  constexpr int pieces = 2000;
  const double h = period / pieces;
  for (std::size_t k = 1; k < x.size(); ++k)
    for (int i = 0; i < pieces; ++i) {
      const auto rate = [&](double zz, double vv, double t) {
        const double input = x[k - 1] + (x[k] - x[k - 1]) * t / period;
        return wc * wc * (input - zz) - 2.0 * zeta * wc * vv;
      };
      const double t = i * h;
      const double a1 = rate(z, v, t), v2 = v + 0.5 * h * a1;
      const double a2 = rate(z + 0.5 * h * v, v2, t + 0.5 * h), v3 = v + 0.5 * h * a2;
      const double a3 = rate(z + 0.5 * h * v2, v3, t + 0.5 * h), v4 = v + h * a3;
      const double a4 = rate(z + h * v3, v4, t + h);
      z += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
  return v;
}

TEST(VelocityEstimator, FollowsTheContinuousFilterExactly) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  for (const double damping : {0.3, 0.9, 1.0, 1.0 + 1e-9, 1.0 - 1e-6, 1.5, 30.0})
    for (const double period : {0.0005, 0.001, 0.005}) {
      std::vector<double> x;
      for (int i = 0; i < 30; ++i) x.push_back(any(random));
      VelocityEstimator estimator(make_estimator_step(filter(50.0, damping), period));
      estimator.start(x[0]);
      for (std::size_t i = 1; i < x.size(); ++i) estimator.step(x[i]);
      const double expected = filtered_by_small_steps(x, period, 2.0 * std::numbers::pi * 50.0, damping);
      EXPECT_NEAR(estimator.velocity(), expected, 1e-7 * (1.0 + std::abs(expected)))
          << damping << " " << period;
    }
}

TEST(VelocityEstimator, GivesARampItsSlopeAndAConstantZero) {
  VelocityEstimator estimator(make_estimator_step(filter(50.0, 0.9), 0.001));
  estimator.start(0.3);
  for (int k = 0; k < 100; ++k) EXPECT_EQ(estimator.step(0.3), 0.0);
  for (int k = 1; k <= 1000; ++k) estimator.step(0.3 + 0.7 * k * 0.001);
  EXPECT_NEAR(estimator.velocity(), 0.7, 1e-11);
}

TEST(VelocityEstimator, HasTheGainAndPhaseOfTheTransferFunction) {
  constexpr double period = 1e-4, frequency = 8.0, damping = 0.9;
  const double w = 2.0 * std::numbers::pi * frequency, wc = 2.0 * std::numbers::pi * 50.0;
  const std::complex<double> s(0.0, w);
  const std::complex<double> h = wc * wc * s / (s * s + 2.0 * damping * wc * s + wc * wc);
  VelocityEstimator estimator(make_estimator_step(filter(50.0, damping), period));
  estimator.start(0.0);
  for (int k = 1; k <= 20000; ++k) {
    const double v = estimator.step(std::sin(w * k * period));
    if (k > 10000) {
      EXPECT_NEAR(v, std::imag(h * std::exp(s * (k * period))), 1e-4 * std::abs(h));
    }
  }
}

TEST(VelocityEstimator, DifferenceIsTheDifference) {
  VelocityEstimator estimator(make_estimator_step({EstimatorKind::difference, 0.0, 0.0}, 0.002));
  estimator.start(1.0);
  EXPECT_DOUBLE_EQ(estimator.step(1.5), 250.0);
  EXPECT_DOUBLE_EQ(estimator.step(1.0), -250.0);
}

ControlConfig gain_seven(double delay_s = 0.0) {
  ControlConfig config;
  config.gains = {70.7107, 304.9273, 143.3152, 61.0833};
  config.delay_s = delay_s;
  return config;
}

TEST(Controller, IsTheGainTimesTheDelayedState) {
  Controller controller(gain_seven(0.003), 1e6);
  std::vector<ControlState> seen;
  for (std::uint64_t k = 0; k < 50; ++k) {
    const double t = static_cast<double>(k);
    const ControlOutput output = controller.step({k, 0.001 * t, 0.002 * t * t, 0.0});
    seen.push_back(output.state);
    const ControlState& past = seen[k < 3 ? 0 : k - 3];
    EXPECT_NEAR(output.voltage_v,
                70.7107 * past.cart_m + 304.9273 * past.theta_rad + 143.3152 * past.cart_velocity_mps +
                    61.0833 * past.pendulum_rate_radps,
                1e-9);
  }
}

TEST(Controller, LimitsAndRefusesWhatIsNotANumber) {
  Controller controller(gain_seven(), 10.0);
  EXPECT_EQ(controller.step({0, 0.0, 1.0, 0.0}).voltage_v, 10.0);
  EXPECT_EQ(controller.step({1, 0.0, -1.0, 0.0}).voltage_v, -10.0);
  const ControlOutput output = controller.step({2, NAN, 0.0, 0.0});
  EXPECT_EQ(output.voltage_v, 0.0);
  EXPECT_FALSE(output.finite);
}

TEST(Controller, KeepsItsTimeAcrossMissingSamples) {
  // A straight line is what missing samples are taken for, so a gap in one must change nothing.
  Controller whole(gain_seven(0.0042), 1e6), holed(gain_seven(0.0042), 1e6);
  for (std::uint64_t k = 0; k < 200; ++k) {
    const double t = static_cast<double>(k);
    const ControlInput input{k, 0.0003 * t, -0.0001 * t, 0.0};
    const double expected = whole.step(input).voltage_v;
    if (k % 7 == 3 || k % 7 == 4) continue;
    EXPECT_NEAR(holed.step(input).voltage_v, expected, 1e-9);
  }
}

TEST(Controller, FeedsBackMeasuredVelocitiesWhereItIsAskedTo) {
  ControlConfig config = gain_seven();
  config.estimator.kind = EstimatorKind::device;
  Controller device(config, 1e6);
  config.estimator.kind = EstimatorKind::difference;
  Controller difference(config, 1e6);
  for (std::uint64_t k = 0; k < 20; ++k) {
    ControlInput input{k, 0.001 * static_cast<double>(k * k), -0.002 * static_cast<double>(k), 0.0};
    const ControlOutput estimated = difference.step(input);
    if (k % 2 == 0) input.cart_velocity_mps = 0.7;
    input.pendulum_rate_radps = -0.4;
    const ControlOutput measured = device.step(input);
    if (k == 0) continue;  // it begins at rest
    EXPECT_EQ(measured.state.cart_velocity_mps, k % 2 == 0 ? 0.7 : estimated.state.cart_velocity_mps);
    EXPECT_EQ(measured.state.pendulum_rate_radps, -0.4);
  }
}

TEST(Controller, BridgesMeasuredVelocitiesOverMissingSamples) {
  ControlConfig config = gain_seven(0.0042);
  config.estimator.kind = EstimatorKind::device;
  Controller whole(config, 1e6), holed(config, 1e6);
  for (std::uint64_t k = 0; k < 100; ++k) {
    const double t = static_cast<double>(k);
    const ControlInput input{k, 0.0003 * t, -0.0001 * t, 0.0, 0.01 * t, -0.02 * t};
    const double expected = whole.step(input).voltage_v;
    if (k % 7 == 3 || k % 7 == 4) continue;
    EXPECT_NEAR(holed.step(input).voltage_v, expected, 1e-9);
  }
}

TEST(Controller, RefusesAPredictorItDoesNotHave) {
  ControlConfig config = gain_seven();
  config.compensation.kind = CompensationKind::predictor;
  EXPECT_THROW(Controller(config, 10.0), ConfigError);
}

TEST(GainFile, ReadsThePapersGains) {
  const ControlConfig config = read_gain_file(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml");
  EXPECT_EQ(config.gains.cart_position_v_per_m, 70.7107);
  EXPECT_EQ(config.gains.pendulum_rate_v_per_radps, 61.0833);
  EXPECT_EQ(config.sample_rate_hz, 1000.0);
  EXPECT_EQ(config.estimator.cutoff_hz, 50.0);
  EXPECT_EQ(config.compensation.kind, CompensationKind::none);
}

TEST(GainFile, WritesWhatReadsBackToTheSameBits) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> any(-500.0, 500.0), part(0.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    ControlConfig config;
    config.gains = {any(random), any(random), any(random), any(random)};
    config.delay_s = part(random);
    config.sample_rate_hz = 1.0 + 9999.0 * part(random);
    config.estimator = {i % 2 == 0   ? EstimatorKind::second_order_filter
                        : i % 4 == 1 ? EstimatorKind::difference
                                     : EstimatorKind::device,
                        1.0 + 100.0 * part(random), 0.1 + part(random)};
    if (i % 3 == 0) config.compensation = {CompensationKind::predictor, "/plants/it's #1.yaml"};
    const ControlConfig back = read_gains(YamlMap::from_text(gain_text(config, {"random"}), "gains.yaml"));
    EXPECT_EQ(back.gains.cart_position_v_per_m, config.gains.cart_position_v_per_m);
    EXPECT_EQ(back.gains.pendulum_rate_v_per_radps, config.gains.pendulum_rate_v_per_radps);
    EXPECT_EQ(back.delay_s, config.delay_s);
    EXPECT_EQ(back.sample_rate_hz, config.sample_rate_hz);
    EXPECT_EQ(back.estimator.kind, config.estimator.kind);
    if (i % 2 == 0) {
      EXPECT_EQ(back.estimator.damping, config.estimator.damping);
    }
    EXPECT_EQ(back.compensation.kind, config.compensation.kind);
    EXPECT_EQ(back.compensation.plant, config.compensation.plant);
  }
}

struct Malformed {
  const char* what;
  const char* find;
  const char* put;
  const char* expect;  // must be in the error
};

TEST(GainFile, RefusesMalformedFilesWithFileLineKeyAndRemedy) {
  const std::string good = gain_text(gain_seven());
  const Malformed cases[] = {
      {"missing gain", "cart_position_v_per_m: 70.7107, ", "", "gains.yaml:1: gains.cart_position_v_per_m"},
      {"unknown gain", "cart_position_v_per_m", "cart_positon_v_per_m", "cart_position"},
      {"nan gain", "70.7107", ".nan", "not finite"},
      {"text gain", "70.7107", "seventy", "not a number"},
      {"negative delay", "delay_s: 0", "delay_s: -0.01", "gains.yaml:3: delay_s"},
      {"long delay", "delay_s: 0", "delay_s: 1000", "gains.yaml:3: delay_s"},
      {"missing delay", "delay_s: 0.0\n", "", "add delay_s"},
      {"zero rate", "sample_rate_hz: 1000", "sample_rate_hz: 0", "gains.yaml:4: sample_rate_hz"},
      {"huge rate", "sample_rate_hz: 1000", "sample_rate_hz: 1e9", "gains.yaml:4: sample_rate_hz"},
      {"unknown key", "delay_s: 0", "delay_ms: 0", "delay_s"},
      {"unknown estimator", "second_order_filter", "second_order", "did you mean second_order_filter"},
      {"filter key on difference", "second_order_filter", "difference", "cutoff_hz"},
      {"zero cut-off", "cutoff_hz: 50", "cutoff_hz: 0", "velocity_estimator.cutoff_hz"},
      {"unknown compensation", "kind: none", "kind: smith", "delay_compensation"},
      {"predictor without plant", "kind: none", "kind: predictor", "add plant"},
      {"list for map", "{kind: none}", "[1, 2]", "delay_compensation"},
  };
  for (const Malformed& bad : cases) {
    std::string text = good;
    const std::size_t at = text.find(bad.find);
    ASSERT_NE(at, std::string::npos) << bad.what;
    text.replace(at, std::string(bad.find).size(), bad.put);
    try {
      read_gains(YamlMap::from_text(text, "gains.yaml"));
      ADD_FAILURE() << bad.what << " was accepted";
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(bad.expect), std::string::npos)
          << bad.what << ": " << error.what();
      EXPECT_NE(std::string(error.what()).find("gains.yaml:"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace upright
