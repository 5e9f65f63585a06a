// Sweeps of the loop as the rig is: encoder steps, the amplifier's limit, true stick-slip of the cart and of
// the pivot, and bristles. One count more or less changes the voltage, so that two engines go apart for good
// some time after the first count in which they differ. Until then they agree to 1e-6; afterwards in what
// becomes of the runs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "sim/loop/closed_loop.hpp"
#include "sim/loop/fast_loop.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/event_engine.hpp"

namespace upright {
namespace {

struct Loop {
  const char* name;
  const char* plant;
  double smoothing = 0.0;
  bool estimates = false;       ///< by a Kalman filter
  double longest_stay_s = 0.0;  ///< delays up to this do not fall within the first half second
  bool predicts = false;        ///< the delay is compensated
  double pivot_nm = 0.0;        ///< dry friction of the pivot
  double lag_s = 0.0;           ///< of the motor
};

class SweepEncoders : public testing::TestWithParam<Loop> {
 protected:
  static Plant plant_of(const std::string& name) {
    return read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + name + ".yaml");
  }

  /// `times`: how many times the pivot's friction and the motor's lag.
  static Plant plant_with_effects(double times = 1.0) {
    Plant plant = plant_of(GetParam().plant);
    if (GetParam().pivot_nm > 0.0) plant.set("pivot_coulomb_friction", {times * GetParam().pivot_nm});
    if (GetParam().lag_s > 0.0) plant.set("motor_lag", {times * GetParam().lag_s});
    return plant;
  }

  static LoopSetup setup() {
    LoopSetup made;
    made.model = make_model<double>(plant_with_effects());
    made.model.smoothing = GetParam().smoothing;
    made.control.gains = {70.7107, 304.9273, 143.3152, 61.0833};
    made.sampled = true;
    made.cart_resolution_m = 2.27485e-5;
    made.angle_resolution_rad = 1.5339808e-3;
    made.amplifier_limit_v = 15.0;
    made.fell_above_rad = 0.6;
    made.duration_s = 10.0;
    if (GetParam().estimates) {
      made.control.gains = {47.4, 120.0, 41.0, 22.8};
      made.control.state_estimator.kind = StateEstimatorKind::kalman;
    }
    if (GetParam().predicts) {
      made.control.gains = {47.4, 120.0, 41.0, 22.8};
      made.control.compensation.kind = CompensationKind::predictor;
    }
    if (GetParam().estimates || GetParam().predicts) {
      const Plant believed = plant_of("viscous");
      made.make_parts = [believed](const ControlConfig& asked) {
        return make_model_parts(asked, believed, believed);
      };
    }
    return made;
  }

  static std::vector<LoopCase> random_cases(std::size_t count, double longest_s, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> part(0.0, 1.0);
    std::vector<LoopCase> cases(count);
    for (LoopCase& one : cases) one = {0.005 + 0.08 * part(random), longest_s * part(random)};
    return cases;
  }

  static constexpr std::size_t periods = 400;

  /// After each period, by the event engine with steps so short that it is the truth.
  static std::vector<PlantState<double>> states_of(const LoopSetup& setup, const LoopCase& start) {
    EngineOptions tight;
    tight.max_step_s = 5e-5;
    ControlConfig control = setup.control;
    control.delay_s = start.delay_s;
    Controller controller(control, setup.amplifier_limit_v,
                          setup.make_parts ? setup.make_parts(control) : ModelParts{});
    SampledLoop<EventEngine<double>> loop(setup.model, control.sample_rate_hz, tight);
    PlantState<double> released;
    released.theta_rad = start.theta0_rad;
    loop.start(released);
    std::vector<PlantState<double>> states;
    while (states.size() < periods) {
      loop.step([&](std::uint64_t tick, const Measured& measured) {
        ControlInput input;
        input.tick = tick;
        input.cart_m = std::nearbyint(measured[0] / setup.cart_resolution_m) * setup.cart_resolution_m;
        input.theta_rad =
            std::nearbyint(measured[1] / setup.angle_resolution_rad) * setup.angle_resolution_rad;
        return controller.step(input).voltage_v;
      });
      states.push_back(loop.engine().state());
    }
    return states;
  }

  static bool same_counts(const LoopSetup& setup, const PlantState<double>& a, const PlantState<double>& b) {
    const auto same = [](double one, double other, double step) {
      return std::nearbyint(one / step) == std::nearbyint(other / step);
    };
    return same(a.cart_m, b.cart_m, setup.cart_resolution_m) &&
           same(a.theta_rad, b.theta_rad, setup.angle_resolution_rad);
  }

  /// Compares with the event engine, period by period: false from the first count that differs on. `lane` of
  /// a period: the state at its end.
  template <class Lane>
  static bool agree(const LoopSetup& setup, const LoopCase& start, const Lane& lane) {
    constexpr double bar = 1e-6;
    const std::vector<PlantState<double>> truth = states_of(setup, start);
    double worst = 0.0;
    bool same = true;
    for (std::size_t tick = 1; tick <= periods && same; ++tick) {
      const PlantState<double> on_lane = lane(tick);
      const PlantState<double>& state = truth[tick - 1];
      worst = std::max(
          {worst, std::abs(on_lane.theta_rad - state.theta_rad), std::abs(on_lane.cart_m - state.cart_m)});
      same = same_counts(setup, on_lane, state);
    }
    EXPECT_LT(worst, bar) << start.theta0_rad << " rad, " << start.delay_s << " s";
    return same;
  }
};

TEST_P(SweepEncoders, AgreeUntilTheFirstCountThatDiffers) {
  LoopSetup setup = SweepEncoders::setup();
  const std::vector<LoopCase> cases = random_cases(240, GetParam().longest_stay_s, 24);
  std::vector<std::vector<LoopResult>> lanes(periods + 1, std::vector<LoopResult>(cases.size()));
  for (std::size_t tick = 1; tick <= periods; ++tick) {
    setup.duration_s = static_cast<double>(tick) * setup.control.period_s();
    run_on_lanes(setup, cases, lanes[tick]);
  }
  std::size_t together = 0;
  for (std::size_t i = 0; i < cases.size(); ++i)
    together += agree(setup, cases[i], [&](std::size_t tick) { return lanes[tick][i].end; }) ? 1 : 0;
  EXPECT_GT(together, cases.size() / 2);
}

/// Friction near rest of any strength, over any velocity.
class SweepEncodersOfStribeck : public SweepEncoders {};

TEST_P(SweepEncodersOfStribeck, AgreeUntilTheFirstCountThatDiffers) {
  std::mt19937_64 random(29);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  const auto log_uniform = [&](double low, double high) { return low * std::pow(high / low, part(random)); };
  constexpr std::size_t runs = 240;
  std::size_t together = 0;
  for (std::size_t i = 0; i < runs; ++i) {
    Plant plant = plant_with_effects();
    plant.cart_mass_kg *= 0.8 + 0.4 * part(random);
    plant.set("stribeck_friction", {log_uniform(0.05, 1.0), log_uniform(0.005, 0.3), 2.0});
    plant.set("coulomb_friction", {log_uniform(0.05, 1.0)});
    SCOPED_TRACE(plant_text(plant));
    LoopSetup setup = SweepEncoders::setup();
    setup.model = make_model<double>(plant);
    const LoopCase start[] = {{0.005 + 0.05 * part(random), GetParam().longest_stay_s * part(random)}};
    ASSERT_TRUE(lanes_can_run(setup));
    together += agree(setup, start[0],
                      [&](std::size_t tick) {
                        setup.duration_s = static_cast<double>(tick) * setup.control.period_s();
                        LoopResult lane[1];
                        run_on_lanes(setup, start, lane);
                        return lane[0].end;
                      })
                    ? 1
                    : 0;
  }
  EXPECT_GT(together, runs / 2);
}

/// Loops that fall from a delay within the range below.
class SweepEncodersFalls : public SweepEncoders {};

TEST_P(SweepEncodersFalls, FallWhereTheEventEngineFalls) {
  const LoopSetup setup = SweepEncoders::setup();
  const std::vector<LoopCase> cases = random_cases(400, 0.12, 25);
  ASSERT_TRUE(lanes_can_run(setup));
  std::vector<LoopResult> lanes(cases.size());
  run_on_lanes(setup, cases, lanes);
  std::size_t differ = 0, fell = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const bool falls = run_with_events(setup, cases[i]).fell();
    fell += falls ? 1 : 0;
    differ += falls != lanes[i].fell() ? 1 : 0;
  }
  EXPECT_LE(differ, cases.size() / 200);  // 99.5 percent agree
  EXPECT_GT(fell, cases.size() / 8);
  EXPECT_LT(fell, cases.size() * 7 / 8);
}

TEST_P(SweepEncodersFalls, FallFromTheSameDelay) {
  const LoopSetup setup = SweepEncoders::setup();
  const auto falls_from = [](const auto& falls) {
    double stays_s = 0.0, falls_s = 0.12;
    while (falls_s - stays_s > 2e-5) {
      const double middle_s = 0.5 * (stays_s + falls_s);
      (falls(middle_s) ? falls_s : stays_s) = middle_s;
    }
    return falls_s;
  };
  std::vector<double> apart_s;
  for (int i = 0; i < 21; ++i) {
    const double theta0_rad = 0.01 + 0.004 * i;
    const double on_lanes_s = falls_from([&](double delay_s) {
      const LoopCase start[] = {{theta0_rad, delay_s}};
      LoopResult result[1];
      run_on_lanes(setup, start, result);
      return result[0].fell();
    });
    const double alone_s = falls_from([&](double delay_s) {
      return run_with_events(setup, {theta0_rad, delay_s}).fell();
    });
    apart_s.push_back(std::abs(on_lanes_s - alone_s));
  }
  std::nth_element(apart_s.begin(), apart_s.begin() + 10, apart_s.end());
  EXPECT_LT(apart_s[10], 1e-4);
}

/// Of smooth friction, lanes take their substeps together.
class SweepEncodersApart : public SweepEncoders {};

TEST_P(SweepEncodersApart, AResultDoesNotDependOnTheRunsBesideIt) {
  LoopSetup setup = SweepEncoders::setup();
  setup.duration_s = 1.0;
  const std::vector<LoopCase> cases = random_cases(40, 0.06, 26);
  std::vector<LoopResult> together(cases.size()), alone(1);
  run_on_lanes(setup, cases, together);
  for (std::size_t i = 0; i < cases.size(); i += 3) {
    run_on_lanes(setup, std::span(cases).subspan(i, 1), alone);
    EXPECT_EQ(alone[0].end.theta_rad, together[i].end.theta_rad) << i;
    EXPECT_EQ(alone[0].end.cart_mps, together[i].end.cart_mps) << i;
    EXPECT_EQ(alone[0].theta_amplitude_rad, together[i].theta_amplitude_rad) << i;
  }
}

void expect_same_bits(const LoopResult& one, const LoopResult& other) {
  EXPECT_EQ(one.fell() ? one.fall_time_s : -1.0, other.fell() ? other.fall_time_s : -1.0);
  EXPECT_EQ(one.theta_amplitude_rad, other.theta_amplitude_rad);
  EXPECT_EQ(one.cart_amplitude_m, other.cart_amplitude_m);
  EXPECT_EQ(one.end.theta_rad, other.end.theta_rad);
  EXPECT_EQ(one.end.cart_mps, other.end.cart_mps);
  EXPECT_EQ(one.end.bristle_m, other.end.bristle_m);
  EXPECT_EQ(one.end.theta_radps, other.end.theta_radps);
  EXPECT_EQ(one.end.motor_v, other.end.motor_v);
}

/// Runs that fall at once make room for others; in the other order, other runs share the lanes.
TEST_P(SweepEncodersApart, RefilledLanesGiveTheSameBitsInAnyOrder) {
  LoopSetup setup = SweepEncoders::setup();
  ASSERT_TRUE(lanes_refill(setup));
  setup.duration_s = 1.5;
  setup.fell_above_rad = 0.3;
  setup.amplifier_limit_v = 2.0;
  std::vector<LoopCase> cases = random_cases(60, 0.06, 27);
  for (std::size_t i = 0; i < cases.size(); i += 2) cases[i] = {0.28 + 0.0003 * static_cast<double>(i), 0.2};
  const std::vector<LoopCase> reversed(cases.rbegin(), cases.rend());
  for (const LaneRegisters registers : {LaneRegisters::wide, LaneRegisters::baseline}) {
    std::vector<LoopResult> forward(cases.size()), backward(cases.size()), alone(1);
    run_on_lanes(setup, cases, forward, registers);
    run_on_lanes(setup, reversed, backward, registers);
    std::size_t fell = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      SCOPED_TRACE(i);
      expect_same_bits(forward[i], backward[cases.size() - 1 - i]);
      if (i % 7 == 0) {
        run_on_lanes(setup, std::span(cases).subspan(i, 1), alone, registers);
        expect_same_bits(forward[i], alone[0]);
      }
      fell += forward[i].fell() ? 1 : 0;
    }
    EXPECT_GE(fell, cases.size() / 4);
    EXPECT_LE(fell, cases.size() * 3 / 4);
  }
}

/// Lanes have different plants at once, also different lags and pivots, but for plants whose input delays or
/// whole numbers differ.
TEST_P(SweepEncodersApart, PlantsSideBySideGiveTheBitsOfOneAtATime) {
  LoopSetup setup = SweepEncoders::setup();
  setup.duration_s = 1.0;
  const std::vector<LoopCase> cases = random_cases(3, 0.05, 28);
  std::vector<PlantModel<double>> plants;
  for (int i = 0; i < 12; ++i) {
    Plant plant = plant_with_effects(1.0 + 0.03 * i);
    plant.cart_mass_kg *= 1.0 + 0.01 * i;
    plant.set("cart_scale", {1.0 + 0.002 * i});
    plant.set("input_delay", {i < 8 ? 0.0012 : 0.001 + 0.0003 * i});
    // Of the first, some are stepped by series and some are not.
    plant.set("stribeck_friction",
              {0.43, i < 4 ? 0.024 + 0.004 * i : 0.1 + 0.002 * i, i < 4 ? 2.0 : 1.9 + 0.01 * i});
    plants.push_back(make_model<double>(plant));
  }
  setup.model = plants[0];
  std::vector<LoopResult> together(plants.size() * cases.size()), alone(cases.size());
  run_plants_on_lanes(setup, plants, cases, together);
  for (std::size_t i = 0; i < plants.size(); ++i) {
    setup.model = plants[i];
    run_on_lanes(setup, cases, alone);
    for (std::size_t k = 0; k < cases.size(); ++k) {
      SCOPED_TRACE(std::to_string(i) + " " + std::to_string(k));
      expect_same_bits(together[i * cases.size() + k], alone[k]);
    }
  }
}

/// Without a voltage limit some of these motions leave all bounds within a period.
TEST(SweepEncodersDiverging, EveryRunEnds) {
  for (const char* plant : {"dynamic", "exponential"}) {
    LoopSetup setup;
    setup.model = make_model<double>(
        read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + plant + ".yaml"));
    setup.control.gains = {70.7107, 340.3402, 143.3, 61.0};
    setup.control.estimator.cutoff_hz = 2000.0;
    setup.sampled = true;
    setup.cart_resolution_m = 2.27485e-5;
    setup.angle_resolution_rad = 1.5339808e-3;
    setup.duration_s = 5.0;
    std::vector<LoopCase> cases;
    for (int i = 0; i < 256; ++i) cases.push_back({0.0175 * (1 + i % 5), 0.00025 * i});
    for (const LaneRegisters registers : {LaneRegisters::wide, LaneRegisters::baseline}) {
      std::vector<LoopResult> lanes(cases.size());
      run_on_lanes(setup, cases, lanes, registers);
      EXPECT_TRUE(lanes.back().fell());
    }
  }
}

std::string name_of_loop(const testing::TestParamInfo<Loop>& loop) {
  return loop.param.name;
}
const Loop with_events[] = {{"stick_slip", "exponential", 0.0, false, 0.014},
                            {"stick_slip_estimated", "exponential", 0.0, true, 0.05},
                            {"bristles", "dynamic", 0.0, false, 0.014},
                            {"bristles_estimated", "dynamic", 0.0, true, 0.05}};
const Loop with_pivot[] = {{"pivot_and_cart", "exponential", 0.0, false, 0.014, false, 0.003},
                           {"pivot_alone", "viscous", 0.0, true, 0.05, false, 0.003},
                           {"pivot_and_bristles", "dynamic", 0.0, false, 0.014, false, 0.003}};
const Loop with_lag[] = {{"lag", "exponential", 0.0, false, 0.012, false, 0.0, 0.001},
                         {"lag_and_pivot", "exponential", 0.0, true, 0.04, false, 0.003, 0.002},
                         {"lag_and_bristles", "dynamic", 0.0, false, 0.012, false, 0.0, 0.0005}};
const Loop with_predictor[] = {{"predicted", "exponential", 0.0, false, 0.1, true},
                               {"estimated_and_predicted", "dynamic", 0.0, true, 0.1, true}};
const Loop smooth[] = {{"smooth", "exponential", 100.0, false, 0.014}};

INSTANTIATE_TEST_SUITE_P(Events, SweepEncoders, testing::ValuesIn(with_events), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Stribeck, SweepEncodersOfStribeck, testing::Values(with_events[0]), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Pivot, SweepEncoders, testing::ValuesIn(with_pivot), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Lag, SweepEncoders, testing::ValuesIn(with_lag), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Predictor, SweepEncoders, testing::ValuesIn(with_predictor), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Smooth, SweepEncoders, testing::ValuesIn(smooth), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Events, SweepEncodersFalls, testing::ValuesIn(with_events), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Pivot, SweepEncodersFalls, testing::ValuesIn(with_pivot), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Lag, SweepEncodersFalls, testing::ValuesIn(with_lag), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Smooth, SweepEncodersFalls, testing::ValuesIn(smooth), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Events, SweepEncodersApart, testing::ValuesIn(with_events), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Pivot, SweepEncodersApart, testing::ValuesIn(with_pivot), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Lag, SweepEncodersApart, testing::ValuesIn(with_lag), name_of_loop);
INSTANTIATE_TEST_SUITE_P(Predictor, SweepEncodersApart, testing::ValuesIn(with_predictor), name_of_loop);

}  // namespace
}  // namespace upright
