#include "upright/model/plant.hpp"

#include <algorithm>
#include <cmath>

#include "upright/model/effect_hooks.hpp"

namespace upright {

const PlantEffect* Plant::find(std::size_t effect) const {
  const auto at =
      std::find_if(effects.begin(), effects.end(), [&](const auto& e) { return e.number == effect; });
  return at == effects.end() ? nullptr : &*at;
}

void Plant::set(std::size_t effect, std::span<const double> values) {
  PlantEffect entry{effect, {}};
  std::copy_n(values.begin(), std::min(values.size(), entry.values.size()), entry.values.begin());
  const auto at =
      std::find_if(effects.begin(), effects.end(), [&](const auto& e) { return e.number == effect; });
  if (at == effects.end()) {
    effects.push_back(entry);
  } else {
    *at = entry;
  }
}

void Plant::remove(std::size_t effect) {
  std::erase_if(effects, [&](const auto& e) { return e.number == effect; });
}

namespace {

std::string fault_of_table(const PlantEffect& table) {
  const double over = table.values[0];
  if (!(over >= 0.0 && over < static_cast<double>(effects::ForceTable::over_count) &&
        over == std::floor(over)))
    return "force_table lies over no quantity: set over to one of its words";
  if (!(table.values[1] < table.values[2]))
    return "force_table ends where it begins or before: set to above from";
  return "";
}

/// "sprung_mass and backlash", say.
std::string attached_kinds(const Plant& plant) {
  std::string kinds;
  for (const PlantEffect& effect : plant.effects)
    if (attaches_mass(effect.number))
      kinds += (kinds.empty() ? "" : " and ") + std::string(effect_registry()[effect.number].kind);
  return kinds;
}

}  // namespace

bool is_dry(const PlantEffect& effect) {
  if (effect.number == effect_index<effects::ForceTable>())
    return effects::ForceTable::has_cart_dry_level(effect.values.data());
  return effect_registry()[effect.number].dry;
}

bool attaches_mass(std::size_t effect) {
  bool attaches = false;
  for_each_effect([&]<std::size_t I>() {
    attaches = attaches || (I == effect && has_attached_mass<EffectAt<I>, double>);
  });
  return attaches;
}

bool needs_pendulum(std::size_t effect) {
  const EffectInfo& info = effect_registry()[effect];
  return info.enters == Enters::pendulum || info.kind.starts_with("pendulum_") ||
         info.kind.starts_with("angle_");
}

std::string fault_of(const Plant& plant) {
  if (const PlantEffect* table = plant.find(effect_index<effects::ForceTable>()))
    if (std::string fault = fault_of_table(*table); !fault.empty()) return fault;
  const PlantEffect* coulomb = plant.find("coulomb_friction");
  const PlantEffect* stribeck = plant.find("stribeck_friction");
  const bool level =
      (coulomb != nullptr && coulomb->values[0] > 0.0) || (stribeck != nullptr && stribeck->values[0] > 0.0);
  if (plant.find("bristle_friction") != nullptr && !level)
    return "bristle_friction needs a dry friction level, and the plant has none: add coulomb_friction or "
           "stribeck_friction";
  if (std::count_if(plant.effects.begin(), plant.effects.end(),
                    [](const PlantEffect& e) { return attaches_mass(e.number); }) > 1)
    return "the plant has " + attached_kinds(plant) +
           ", and one of these at most may have a motion of its own: remove the others";
  if (plant.pendulum) return "";
  for (const PlantEffect& effect : plant.effects) {
    const std::string kind(effect_registry()[effect.number].kind);
    if (needs_pendulum(effect.number))
      return "the plant has no pendulum, but has " + kind + ": add the pendulum, or remove " + kind;
  }
  return "";
}

}  // namespace upright
