// Plants that tests share.
#pragma once

#include <string>

#include "upright/model/plant_file.hpp"

namespace upright::test {

inline Plant paper_plant() {
  Plant plant;
  plant.cart_mass_kg = 0.815;
  plant.pendulum = Pendulum{0.21, 0.305, {}};
  plant.gravity_mps2 = 9.8;
  plant.motor = {1.7189, 7.682};
  return plant;
}

/// The cart alone, on a motor without back-EMF.
inline Plant free_cart() {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.motor.back_emf_n_per_mps = 0.0;
  return plant;
}

inline Plant config_plant(const std::string& name) {
  return read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + name + ".yaml");
}

}  // namespace upright::test
