// A rig with all masses and forces larger by the same factor moves alike, so it gets the same answer.
#include <gtest/gtest.h>

#include <string>

#include "named_effects.hpp"

namespace upright {
namespace {

Plant heavier(Plant plant, double factor) {
  plant.cart_mass_kg *= factor;
  plant.motor.force_per_volt_n *= factor;
  plant.motor.back_emf_n_per_mps *= factor;
  for (const char* kind : {"viscous_friction", "coulomb_friction", "cable_spring", "quadratic_drag"})
    if (const PlantEffect* effect = plant.find(kind)) {
      std::array values = effect->values;
      values[0] *= factor;
      plant.set(effect->number, values);
    }
  if (const PlantEffect* bristles = plant.find("bristle_friction"))
    plant.set(bristles->number, std::array{factor * bristles->values[0], factor * bristles->values[1]});
  return plant;
}

/// The size of an effect that is named in runs of a rig that has it; NaN if it is not.
double found_size(const Plant& believed, const Plant& truth, std::string_view kind) {
  const Diagnosis d = diagnose(believed, three_runs({.plant = truth}, 6.0, 11), {});
  for (const FoundEffect& effect : d.effects)
    if (kind_of(effect.effect) == kind) return effect.parameters[0].value;
  return std::numeric_limits<double>::quiet_NaN();
}

void expect_alike(std::string_view kind, std::initializer_list<double> values,
                  const Plant& file = cart_with_friction()) {
  Plant truth = file;
  truth.set(kind, values);
  const double size = found_size(file, truth, kind);
  constexpr double factor = 85.0;
  EXPECT_NEAR(size, *values.begin(), 0.05 * size) << kind;
  EXPECT_NEAR(found_size(heavier(file, factor), heavier(truth, factor), kind), factor * size,
              0.01 * factor * size)
      << kind;
}

// The motor brakes in the same way, and its number is in the file: what is believed of it decides.
TEST(HeavyRig, HasTheSameFriction) {
  Plant file = cart_with_friction();
  file.remove(effect_number("viscous_friction"));
  expect_alike("viscous_friction", {3.5}, file);
}

TEST(HeavyRig, HasTheSameSpring) {
  expect_alike("cable_spring", {40.0, 0.1});
}

TEST(HeavyRig, HasTheSameDrag) {
  expect_alike("quadratic_drag", {15.0});
}

TEST(HeavyRig, HasTheSameBristles) {
  expect_alike("bristle_friction", {2000.0, 50.0});
}

}  // namespace
}  // namespace upright
