// An effect whose size differs from run to run is listed as such, and one that all runs share is named.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "measurement/dataset_file.hpp"
#include "named_effects.hpp"

namespace upright {
namespace {

/// A run of a cart with Coulomb friction of 0.4 N and this constant force.
Measurement run_with_force(double force_n, unsigned number, double duration_s) {
  blind::Rig rig{.plant = cart_with_friction()};
  rig.plant.set("constant_force", {force_n});
  blind::Plan plan;
  plan.experiment = number % 2 == 1 ? blind::Experiment::square : blind::Experiment::multisine;
  plan.rate_hz = 200.0;
  plan.duration_s = duration_s;
  plan.seed = 500 + number;
  return measure(rig, plan, "run" + std::to_string(number));
}

std::vector<Measurement> runs_with_forces(const std::vector<double>& forces_n, double duration_s = 8.0) {
  std::vector<Measurement> runs;
  for (const double force_n : forces_n)
    runs.push_back(run_with_force(force_n, static_cast<unsigned>(runs.size()), duration_s));
  return runs;
}

/// A constant force, whichever of its names stands for it.
bool is_constant_force(std::size_t effect) {
  for (const char* kind : {"constant_force", "friction_asymmetry", "voltage_offset"})
    if (kind_of(effect) == kind) return true;
  return false;
}

const FoundEffect* constant_force(const Diagnosis& d) {
  for (const FoundEffect& effect : d.effects)
    if (is_constant_force(effect.effect)) return &effect;
  return nullptr;
}

const LocalEffect* local_constant_force(const Diagnosis& d) {
  for (const LocalEffect& effect : d.helps_here_only)
    if (is_constant_force(effect.effect) && !effect.by_run.empty()) return &effect;
  return nullptr;
}

std::string listed(const Diagnosis& d) {
  std::string text;
  for (const LocalEffect& effect : d.helps_here_only)
    text += kind_of(effect.effect) + ": " + effect.where + "\n";
  return text;
}

TEST(RunDifferences, AForceOfTheRunIsNotNamed) {
  const std::vector<double> forces_n = {0.30, 0.15, 0.02, 0.25};
  const Diagnosis d = diagnose(cart_with_friction(), runs_with_forces(forces_n));
  EXPECT_EQ(constant_force(d), nullptr);
  const LocalEffect* force = local_constant_force(d);
  ASSERT_NE(force, nullptr) << listed(d);
  ASSERT_EQ(force->by_run.size(), forces_n.size());
  for (std::size_t r = 0; r < forces_n.size(); ++r) {
    EXPECT_EQ(force->by_run[r].run, r);
    EXPECT_NEAR(std::abs(force->by_run[r].value), forces_n[r], 0.01) << r;
  }
  EXPECT_NE(force->where.find("differs from run to run"), std::string::npos) << force->where;
}

TEST(RunDifferences, ItSaysOfWhichLabelTheForceIs) {
  std::vector<Measurement> runs = runs_with_forces({0.30, 0.03, 0.31, 0.02, 0.29}, 4.0);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    auto dataset = std::make_shared<Dataset>();
    dataset->labels = {{"cable", r % 2 == 0 ? "new" : "old"}, {"operator", r < 3 ? "Kim" : "Lee"}};
    runs[r].dataset = dataset;
  }
  const Diagnosis d = diagnose(cart_with_friction(), runs);
  const LocalEffect* force = local_constant_force(d);
  ASSERT_NE(force, nullptr) << listed(d);
  EXPECT_NE(force->where.find("on the label cable"), std::string::npos) << force->where;
  EXPECT_NE(force->where.find("in run1 (old)"), std::string::npos) << force->where;
}

TEST(RunDifferences, AForceOfTheRigIsNamed) {
  const Diagnosis d = diagnose(cart_with_friction(), runs_with_forces({0.2, 0.2, 0.2}));
  const FoundEffect* force = constant_force(d);
  ASSERT_NE(force, nullptr);
  ASSERT_EQ(force->by_run.size(), 3u);
  std::size_t holds = 0;
  for (const RunSize& of : force->by_run) holds += of.low < 0.2 && 0.2 < of.high ? 1 : 0;
  EXPECT_GE(holds, 2u);
}

TEST(RunDifferences, AForceThatVariesALittleIsNamed) {
  const Diagnosis d = diagnose(cart_with_friction(), runs_with_forces({0.20, 0.22, 0.21}));
  const FoundEffect* force = constant_force(d);
  ASSERT_NE(force, nullptr);
  EXPECT_NEAR(std::abs(force->parameters[0].value), 0.21, 0.015);
}

}  // namespace
}  // namespace upright
