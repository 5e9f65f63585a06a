// Both engines follow the same trajectory to 1e-6 of its extent over 10 s, through the same events, for each
// friction model, every other kind of effect, and each loop form.
//
// Where the motion is chaotic no two integrations agree. It counts as regular for as long as a second run,
// begun 1e-9 rad aside, stays within 1e3 times that (relative to the extent); runs are compared that long.
// The three friction models must be regular for the whole 10 s, everything else for at least 2 s.
#include <gtest/gtest.h>

#include "../unit/plants.hpp"
#include "engine_runs.hpp"
#include "sim/cvode_engine.hpp"

namespace upright {
namespace {

using namespace test;

struct Subject {
  const char* name;
  bool whole;  ///< regular for the whole run
  Plant plant;
  double tolerance = 1e-6;  ///< relative to the extent of the motion
};

std::vector<Subject> subjects() {
  const Plant viscous = config_plant("viscous");
  const Plant exponential = config_plant("exponential");
  const Plant dynamic = config_plant("dynamic");
  std::vector<Subject> all = {
      {"viscous", true, viscous}, {"exponential", true, exponential}, {"dynamic", true, dynamic}};
  const auto add = [&](const char* name, Plant plant, auto... effects) {
    (plant.set(effects.first, effects.second), ...);
    all.push_back({name, false, plant});
  };
  using E = std::pair<const char*, std::initializer_list<double>>;
  add("saturation_dead_zone", exponential, E{"voltage_saturation", {8.0}}, E{"voltage_dead_zone", {0.3}});
  add("gain_offset", dynamic, E{"voltage_gain", {0.93}}, E{"voltage_offset", {0.15}},
      E{"voltage_saturation", {12.0}});
  add("lag_and_input_delay", exponential, E{"motor_lag", {0.004}}, E{"input_delay", {0.0033}});
  add("kinks", viscous, E{"quadratic_drag", {1.0}}, E{"viscous_asymmetry", {0.5}},
      E{"pivot_quadratic_drag", {0.001}});
  add("asymmetric_dry", exponential, E{"friction_asymmetry", {0.15}}, E{"position_dependent_friction", {0.5}},
      E{"constant_force", {0.1}});
  add("track", exponential, E{"cogging_force", {0.3, 0.01, 0.2}}, E{"cable_spring", {2.0, 0.01}});
  add("warming", exponential, E{"warming_friction", {0.3, 1.5}}, E{"viscous_asymmetry", {0.5}});
  add("sprung", exponential, E{"sprung_mass", {0.1, 6.0, 0.05}}, E{"motor_lag", {0.004}});
  add("flexible_rod", exponential, E{"flexible_rod", {0.3, 12.0, 0.05}},
      E{"pivot_coulomb_friction", {0.002}});
  add("velocity_ripple", exponential, E{"velocity_ripple", {0.2, 0.15}});
  add("loaded", exponential, E{"load_dependent_friction", {0.1}}, E{"motor_lag", {0.004}});
  // Steps of fixed length cross the kink where the motor's force changes direction: up to 3.7e-6.
  all.back().tolerance = 1e-5;
  // Likewise the edges of its flanks.
  add("backlash", exponential, E{"backlash", {2e-4, 0.2, 1e5, 10.0}});
  all.back().tolerance = 1e-5;
  add("ripple", exponential, E{"torque_ripple", {0.1, 0.01, 0.2}}, E{"motor_lag", {0.004}});
  add("pivot", exponential, E{"pivot_coulomb_friction", {0.003}}, E{"pivot_viscous_friction", {0.001}});
  add("sensors", exponential, E{"angle_scale", {1.02}}, E{"cart_scale", {0.98}}, E{"angle_offset", {0.002}});
  add("eccentric", exponential, E{"encoder_eccentricity", {0.03, 0.02, 0.4}}, E{"cart_scale", {0.98}});
  add("counter", exponential, E{"lost_counts", {0.5, 0.2}}, E{"cart_scale", {0.98}});
  add("drive", exponential, E{"drive_compliance", {2e-4}}, E{"motor_lag", {0.004}});
  add("base", dynamic, E{"cart_mass", {1.1}}, E{"pendulum_mass", {0.9}}, E{"pendulum_length", {1.05}},
      E{"back_emf", {0.95}});
  add("stiff_bristles", exponential, E{"bristle_friction", {1e5, 70.0}});
  return all;
}

/// How many records two nearby runs stay together.
std::size_t regular_records(const Plant& plant, const RunCase& run, const RecordedRun& from) {
  constexpr double aside_rad = 1e-9, max_growth = 1e3;
  RunCase beside = run;
  beside.theta0_rad += aside_rad;
  const RecordedRun other = record<EventEngine<double>>(plant, beside);
  const Extent extent(from);
  const std::size_t both = std::min(from.states.size(), other.states.size());
  for (std::size_t i = 0; i < both; ++i)
    if (extent.distance(from.states[i], other.states[i]) > max_growth * aside_rad / extent.theta_rad)
      return i;
  return both;
}

class Agreement : public testing::TestWithParam<std::tuple<std::size_t, RunCase>> {};

TEST_P(Agreement, OnTrajectoryAndEvents) {
  const auto& [number, run] = GetParam();
  const Subject subject = subjects()[number];
  const RecordedRun fast = record<EventEngine<double>>(subject.plant, run);
  const RecordedRun reference = record<CvodeEngine>(subject.plant, run);
  const std::size_t regular = regular_records(subject.plant, run, fast);
  ASSERT_GE(static_cast<double>(regular) * record_period_s, subject.whole ? 10.0 - 1e-9 : 2.0);
  ASSERT_GE(reference.states.size(), regular);
  const Extent extent(reference);
  double worst = 0.0;
  for (std::size_t i = 0; i < regular; ++i)
    worst = std::max(worst, extent.distance(fast.states[i], reference.states[i]));
  EXPECT_LT(worst, subject.tolerance);
  RecordProperty("worst_relative_difference", std::to_string(worst * 1e9) + "e-9");
  for (std::size_t i = 0; i < std::min(fast.events.size(), reference.events.size()); ++i) {
    if (fast.events[i].time_s > static_cast<double>(regular) * record_period_s) return;
    EXPECT_EQ(fast.events[i].kind, reference.events[i].kind) << i;
    EXPECT_NEAR(fast.events[i].time_s, reference.events[i].time_s, 2e-5) << i;
  }
  EXPECT_EQ(fast.event_count, reference.event_count);
}

std::vector<std::size_t> all_subjects() {
  std::vector<std::size_t> numbers(subjects().size());
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
  return numbers;
}

std::string name_of_case(const testing::TestParamInfo<std::tuple<std::size_t, RunCase>>& info) {
  const RunCase run = std::get<1>(info.param);
  const char* form = run.form == LoopForm::open      ? "open"
                     : run.form == LoopForm::sampled ? "sampled"
                                                     : "continuous";
  return std::string(subjects()[std::get<0>(info.param)].name) + "_" + form + "_" +
         std::to_string(std::lround(run.delay_s * 1e6)) + "us";
}

INSTANTIATE_TEST_SUITE_P(Runs, Agreement,
                         testing::Combine(testing::ValuesIn(all_subjects()),
                                          testing::Values(RunCase{LoopForm::open, 0.0, 0.3},
                                                          RunCase{LoopForm::sampled, 0.0, 0.05},
                                                          RunCase{LoopForm::sampled, 0.006, 0.03},
                                                          RunCase{LoopForm::continuous, 0.0, 0.05},
                                                          RunCase{LoopForm::continuous, 0.0053, 0.04})),
                         name_of_case);

}  // namespace
}  // namespace upright
