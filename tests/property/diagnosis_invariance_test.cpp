// The same data written otherwise give the same names: the order of the runs, the zero of the time, the
// direction of the axes, a run in two files, more effort. (The number of threads: diagnose_command_test.)
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "blind_case.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {
namespace {

Plant file_plant() {
  Plant plant;
  plant.cart_mass_kg = 0.815;
  plant.pendulum = Pendulum{0.21, 0.305, {}};
  plant.motor = {1.7189, 7.682};
  plant.set("viscous_friction", {3.0});
  return plant;
}

/// Three runs of a rig with Coulomb friction and a constant force, the pendulum hanging.
const std::vector<Measurement>& recorded() {
  static const std::vector<Measurement> runs = [] {
    blind::Rig rig{.plant = file_plant()};
    rig.plant.cart_mass_kg *= 1.015;
    rig.plant.set("coulomb_friction", {0.3});
    rig.plant.set("constant_force", {0.2});
    std::vector<Measurement> all;
    for (unsigned r = 0; r < 3; ++r) {
      blind::Plan plan;
      plan.experiment = r == 1 ? blind::Experiment::square : blind::Experiment::multisine;
      plan.rate_hz = 200.0;
      plan.duration_s = 5.0;
      plan.swing_rad = 0.3;
      plan.seed = 70 + r;
      all.push_back(measure(rig, plan, std::string("run").append(std::to_string(r))));
    }
    return all;
  }();
  return runs;
}

struct Said {
  std::string verdict;
  std::set<std::string> names;
  bool operator==(const Said&) const = default;
  friend void PrintTo(const Said& said, std::ostream* out) {
    *out << said.verdict << " " << ::testing::PrintToString(said.names);
  }
};

Said said_of(const std::vector<Measurement>& runs, double effort = default_search_bound) {
  DiagnosisOptions options;
  options.search_bound = effort;
  const Diagnosis d = diagnose(file_plant(), runs, options);
  Said said{std::string(name_of(d.verdict)), {}};
  for (const FoundEffect& effect : d.effects) said.names.insert(kind_of(effect.effect));
  return said;
}

const Said& said_of_recorded() {
  static const Said said = said_of(recorded());
  return said;
}

TEST(SameNames, AreThoseThatAreHidden) {
  EXPECT_EQ(said_of_recorded().verdict, "explained");
  EXPECT_TRUE(said_of_recorded().names.contains("coulomb_friction"));
  EXPECT_TRUE(said_of_recorded().names.contains("constant_force"));
}

TEST(SameNames, InWhateverOrderTheRunsAreGiven) {
  std::vector<Measurement> runs = recorded();
  std::reverse(runs.begin(), runs.end());
  EXPECT_EQ(said_of(runs), said_of_recorded());
}

TEST(SameNames, WheneverTheClockWasStarted) {
  std::vector<Measurement> runs = recorded();
  for (Measurement& run : runs)
    for (double& t : run.time_s) t += 64.0;
  EXPECT_EQ(said_of(runs), said_of_recorded());
}

TEST(SameNames, WithAllAxesReversed) {
  std::vector<Measurement> runs = recorded();
  for (Measurement& run : runs)
    for (auto* values : {&run.voltage_v, &run.cart_m, &run.theta_rad})
      for (double& v : *values) v = -v;
  EXPECT_EQ(said_of(runs), said_of_recorded());
}

TEST(SameNames, OfARunThatWasWrittenInTwoParts) {
  std::vector<Measurement> runs = recorded();
  Measurement &first = runs.back(), second = first;
  const auto half = static_cast<std::ptrdiff_t>(first.size() / 2);
  for (auto member : {&Measurement::time_s, &Measurement::voltage_v, &Measurement::cart_m,
                      &Measurement::theta_rad, &Measurement::cart_weight, &Measurement::theta_weight}) {
    if ((first.*member).empty()) continue;
    (second.*member).erase((second.*member).begin(), (second.*member).begin() + half);
    (first.*member).resize(static_cast<std::size_t>(half));
  }
  second.name = "second part";
  runs.push_back(second);
  EXPECT_EQ(said_of(runs), said_of_recorded());
}

TEST(SameNames, WithTwiceTheEffort) {
  EXPECT_EQ(said_of(recorded(), 2.0 * default_search_bound), said_of_recorded());
}

}  // namespace
}  // namespace upright
