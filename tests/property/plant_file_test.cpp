// Plant files: any plant writes back exactly, and each missing, unknown or impossible entry is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../unit/plants.hpp"
#include "upright/base/error.hpp"

namespace upright {
namespace {

using test::config_plant;
using test::paper_plant;

class RandomPlants {
 public:
  Plant operator()() {
    Plant plant;
    plant.cart_mass_kg = positive();
    if (coin()) {
      plant.pendulum = Pendulum{positive(), positive(), {}};
      if (coin()) plant.pendulum->given_inertia_kgm2 = plant.pendulum->inertia_about_pivot_kgm2() * 1.1;
    }
    plant.gravity_mps2 = coin() ? positive() : 0.0;
    plant.motor = {any(), positive()};
    for (std::size_t i = 0; i < effect_count; ++i)
      if (coin()) plant.set(i, values_of_effect(i));
    while (!fault_of(plant).empty()) plant.effects.pop_back();
    return plant;
  }

 private:
  bool coin() { return generator_() % 2 == 0; }
  double positive() { return std::pow(10.0, std::uniform_real_distribution<double>(-3.0, 3.0)(generator_)); }
  double any() { return coin() ? positive() : -positive(); }
  std::vector<double> values_of_effect(std::size_t number) {
    std::vector<double> values;
    for (const ParameterInfo& parameter : effect_registry()[number].parameters) {
      if (!parameter.words.empty()) {
        values.push_back(static_cast<double>(generator_() % parameter.words.size()));
        continue;
      }
      double value = any();
      for (int tries = 0; tries < 50 && !parameter.range.contains(value); ++tries)
        value = any() / (1 + tries);
      values.push_back(parameter.range.contains(value) ? value : parameter.typical);
    }
    return values;
  }
  std::mt19937_64 generator_{20261121};
};

Plant read_text(const std::string& text) {
  return read_plant(YamlMap::from_text(text, "plant.yaml"));
}

TEST(PlantFile, AnyPlantReadsBackExactly) {
  RandomPlants plants;
  for (int n = 0; n < 500; ++n) {
    const Plant plant = plants();
    const std::string text = plant_text(plant, {"a comment"});
    const Plant copy = read_text(text);
    EXPECT_EQ(copy.cart_mass_kg, plant.cart_mass_kg);
    EXPECT_EQ(copy.gravity_mps2, plant.gravity_mps2);
    EXPECT_EQ(copy.motor.force_per_volt_n, plant.motor.force_per_volt_n);
    EXPECT_EQ(copy.motor.back_emf_n_per_mps, plant.motor.back_emf_n_per_mps);
    ASSERT_EQ(copy.pendulum.has_value(), plant.pendulum.has_value());
    if (plant.pendulum) {
      EXPECT_EQ(copy.pendulum->mass_kg, plant.pendulum->mass_kg);
      EXPECT_EQ(copy.pendulum->length_to_com_m, plant.pendulum->length_to_com_m);
      EXPECT_EQ(copy.pendulum->given_inertia_kgm2, plant.pendulum->given_inertia_kgm2);
    }
    ASSERT_EQ(copy.effects.size(), plant.effects.size());
    for (std::size_t i = 0; i < plant.effects.size(); ++i) {
      EXPECT_EQ(copy.effects[i].number, plant.effects[i].number);
      EXPECT_EQ(copy.effects[i].values, plant.effects[i].values);
    }
    EXPECT_EQ(plant_text(copy, {"a comment"}), text);
  }
}

TEST(PlantFile, ShippedPlantsReadBack) {
  for (const char* name : {"viscous", "exponential", "dynamic"}) {
    const std::string text = plant_text(config_plant(name));
    EXPECT_EQ(text, plant_text(read_text(text)));
  }
}

/// One effect as it stands in a file, with one parameter left out, misspelt or given another value.
std::string effect_file(const EffectInfo& info, std::size_t changed, const std::string& name,
                        const std::string& value) {
  std::string item = "    - {kind: " + std::string(info.kind);
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    const std::string own_name(info.parameters[i].name);
    if (i != changed) {
      item += ", " + own_name + ": " + value_text(info.parameters[i], info.parameters[i].typical);
    } else if (!value.empty()) {
      item += ", " + (name.empty() ? own_name : name) + ": " + value;
    }
  }
  std::string text = plant_text(paper_plant());
  const std::size_t end = text.find("  effects: []");
  text = text.substr(0, end) + "  effects:\n";
  if (info.kind == "bristle_friction") text += "    - {kind: coulomb_friction, force_n: 0.4}\n";
  return text + item + "}\n";
}

TEST(PlantFile, EachParameterOfEachEffectIsRequiredKnownAndInRange) {
  for (const EffectInfo& info : effect_registry())
    for (std::size_t i = 0; i < info.parameters.size(); ++i) {
      const ParameterInfo& parameter = info.parameters[i];
      const std::string typical = value_text(parameter, parameter.typical);
      EXPECT_NO_THROW(read_text(effect_file(info, i, "", typical))) << info.kind;
      EXPECT_THROW(read_text(effect_file(info, i, "", "")), ConfigError) << info.kind;
      EXPECT_THROW(read_text(effect_file(info, i, std::string(parameter.name) + "x", typical)), ConfigError);
      EXPECT_THROW(read_text(effect_file(info, i, "", "some")), ConfigError) << info.kind;
      if (!parameter.words.empty()) {
        EXPECT_THROW(read_text(effect_file(info, i, "", "0")), ConfigError) << info.kind;
      }
      EXPECT_THROW(read_text(effect_file(info, i, "", ".inf")), ConfigError) << info.kind;
      EXPECT_THROW(read_text(effect_file(info, i, "", ".nan")), ConfigError) << info.kind;
      for (const double outside : {-1e9, 0.0, 1e9})
        if (!parameter.range.contains(outside)) {
          EXPECT_THROW(read_text(effect_file(info, i, "", exact_text(outside))), ConfigError) << info.kind;
        }
    }
}

}  // namespace
}  // namespace upright
