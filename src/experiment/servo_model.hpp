// What an experiment's script knows of the rig that it moves.
#pragma once

#include <string>

#include "upright/base/yaml_reader.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// What the script knows of the rig: enough to move the cart, to stop it in time, and to swing the pendulum
/// up. Taken from the plant file, kept in run.yaml so that the run replays.
struct ServoModel {
  double mass_kg = 1.0;            ///< cart and pendulum together
  double force_per_volt_n = 1.0;   ///< at the motor
  double damping_n_per_mps = 0.0;  ///< back-EMF and viscous friction
  double sliding_n = 0.0;          ///< dry friction while it slides
  double breakaway_n = 0.0;        ///< dry friction to overcome at rest
  double pendulum_m = 0.0;         ///< inertia / (mass x length): 4/3 l for a rod; 0: no pendulum
  double reaction_m = 0.0;         ///< pendulum mass x length / mass
  double gravity_mps2 = 9.8;
};

ServoModel servo_model(const Plant& plant);
std::string servo_text(const ServoModel& model);
ServoModel read_servo(const YamlMap& map);

}  // namespace upright
