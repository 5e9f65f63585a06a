#include "without_effect.hpp"

namespace upright {

FitPoint moved_to(FitPoint point, const Plant& plant) {
  convert_initial_states(point.starts, point.plant, plant);
  point.plant = plant;
  return point;
}

Plant without_effect(Plant plant, std::size_t effect, const Plant& given) {
  if (const PlantEffect* in_file = given.find(effect))
    plant.set(effect, in_file->values);
  else
    plant.remove(effect);
  return plant;
}

bool is_removable(const Plant& plant, std::size_t effect, const Plant& given) {
  return fault_of(without_effect(plant, effect, given)).empty();
}

FitResult fit_without(const FitData& data, const FitPoint& with, std::size_t effect,
                      std::vector<FreeParameter> free, const Plant& given, const FitOptions& options) {
  std::erase_if(free, [&](const FreeParameter& p) { return p.effect == effect; });
  return fit(data, moved_to(with, without_effect(with.plant, effect, given)), free, options);
}

}  // namespace upright
