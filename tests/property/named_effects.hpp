// What a diagnosis names beside corrections of the plant file's numbers.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "upright/diagnosis/diagnosis.hpp"
#include "upright/model/registry.hpp"

namespace upright {

inline std::set<std::string> named_effects(const std::vector<Measurement>& runs, const Plant& believed) {
  std::set<std::string> names;
  for (const FoundEffect& effect : diagnose(believed, runs, {}).effects)
    if (effect_registry()[effect.effect].enters != Enters::parameter) names.insert(kind_of(effect.effect));
  return names;
}

}  // namespace upright
