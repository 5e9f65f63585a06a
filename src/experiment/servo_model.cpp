#include "servo_model.hpp"

#include "model/rigid_body.hpp"

namespace upright {

ServoModel servo_model(const Plant& plant) {
  ServoModel model;
  const RigidBody body = rigid_body(plant);
  model.mass_kg = body.mass_kg;
  model.gravity_mps2 = plant.gravity_mps2;
  model.force_per_volt_n = plant.motor.force_per_volt_n;
  model.damping_n_per_mps = plant.motor.back_emf_n_per_mps;
  if (plant.pendulum) {
    model.pendulum_m = body.equivalent_length_m();
    model.reaction_m = body.moment_kgm / body.mass_kg;
  }
  if (const PlantEffect* viscous = plant.find("viscous_friction"))
    model.damping_n_per_mps += viscous->values[0];
  if (const PlantEffect* coulomb = plant.find("coulomb_friction")) model.sliding_n = coulomb->values[0];
  model.breakaway_n = model.sliding_n;
  if (const PlantEffect* stribeck = plant.find("stribeck_friction")) model.breakaway_n += stribeck->values[0];
  return model;
}

std::string servo_text(const ServoModel& m) {
  return "{mass_kg: " + exact_text(m.mass_kg) + ", force_per_volt_n: " + exact_text(m.force_per_volt_n) +
         ", damping_n_per_mps: " + exact_text(m.damping_n_per_mps) +
         ", sliding_n: " + exact_text(m.sliding_n) + ", breakaway_n: " + exact_text(m.breakaway_n) +
         ", pendulum_m: " + exact_text(m.pendulum_m) + ", reaction_m: " + exact_text(m.reaction_m) +
         ", gravity_mps2: " + exact_text(m.gravity_mps2) + "}";
}

ServoModel read_servo(const YamlMap& map) {
  ServoModel m;
  m.mass_kg = map.number("mass_kg", Range::positive());
  m.force_per_volt_n = map.number("force_per_volt_n", Range::positive());
  m.damping_n_per_mps = map.number("damping_n_per_mps");
  m.sliding_n = map.number("sliding_n");
  m.breakaway_n = map.number("breakaway_n");
  m.pendulum_m = map.number("pendulum_m", Range::not_negative());
  m.reaction_m = map.number("reaction_m", Range::not_negative());
  m.gravity_mps2 = map.number("gravity_mps2");
  map.finish();
  return m;
}

}  // namespace upright
