// What a diagnosis names beside corrections of the plant file's numbers, and short runs of a cart for it. A
// force that it draws as a curve has no name. Tests that expect one effect alone compare its values here.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "blind_run.hpp"
#include "upright/diagnosis/diagnosis.hpp"
#include "upright/model/registry.hpp"

namespace upright {

inline std::set<std::string> named_effects(const std::vector<Measurement>& runs, const Plant& believed) {
  std::set<std::string> names;
  for (const FoundEffect& effect : diagnose(believed, runs, {}).effects)
    if (effect_registry()[effect.effect].enters != Enters::parameter &&
        kind_of(effect.effect) != "force_table")
      names.insert(kind_of(effect.effect));
  return names;
}

/// A cart with viscous and dry friction, as its plant file has it.
inline Plant cart_with_friction() {
  Plant plant;
  plant.cart_mass_kg = 0.815;
  plant.motor = {1.7189, 7.682};
  plant.set("viscous_friction", {3.0});
  plant.set("coulomb_friction", {0.4});
  return plant;
}

/// A cart with friction that carries a pendulum.
inline Plant cart_with_pendulum() {
  Plant plant = cart_with_friction();
  plant.pendulum = Pendulum{0.21, 0.305, {}};
  return plant;
}

/// Three runs of a rig at 200 Hz that move its cart in two ways.
inline std::vector<Measurement> three_runs(const blind::Rig& rig, double duration_s, unsigned seed) {
  std::vector<Measurement> runs;
  for (unsigned r = 0; r < 3; ++r) {
    blind::Plan plan;
    plan.experiment = r == 1 ? blind::Experiment::square : blind::Experiment::multisine;
    plan.rate_hz = 200.0;
    plan.duration_s = duration_s;
    plan.seed = 100 * seed + r;
    runs.push_back(measure(rig, plan, std::string("run").append(std::to_string(r))));
  }
  return runs;
}

/// The effect that is named alone, with the values that were found.
inline PlantEffect only_named(const Plant& believed, const Plant& truth) {
  const Diagnosis d = diagnose(believed, three_runs({.plant = truth}, 6.0, 5), {});
  EXPECT_EQ(d.verdict, Verdict::explained);
  EXPECT_EQ(d.effects.size(), 1u);
  if (d.effects.size() != 1) return {};
  return *d.model.find(d.effects.front().effect);
}

/// Each value within a share of it.
inline void expect_values(const PlantEffect& found, std::string_view kind,
                          std::initializer_list<double> values, double tolerance) {
  ASSERT_EQ(kind_of(found.number), kind);
  std::size_t i = 0;
  for (const double value : values) {
    EXPECT_NEAR(found.values[i], value, tolerance * value) << i;
    ++i;
  }
}

}  // namespace upright
