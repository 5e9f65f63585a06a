#include "perturbed_plant.hpp"

#include <random>

namespace upright {

Plant perturbed_plant(Plant plant, unsigned seed, double share) {
  std::mt19937 random(seed);
  const auto part = [&] { return (random() & 1u) != 0 ? 1.0 + share : 1.0 - share; };
  plant.cart_mass_kg *= part();
  plant.pendulum->mass_kg *= part();
  plant.pendulum->given_inertia_kgm2 = plant.pendulum->inertia_about_pivot_kgm2() * part();
  plant.pendulum->length_to_com_m *= part();
  plant.motor.force_per_volt_n *= part();
  plant.motor.back_emf_n_per_mps *= part();
  for (PlantEffect& effect : plant.effects)
    for (double& value : effect.values) value *= part();
  return plant;
}

}  // namespace upright
