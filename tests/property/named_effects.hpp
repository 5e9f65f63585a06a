// What a diagnosis names beside corrections of the plant file's numbers, and short runs of a cart for it. A
// force that it draws as a curve has no name.
#pragma once

#include <set>
#include <string>
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

}  // namespace upright
