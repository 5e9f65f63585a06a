#include "upright/model/plant_file.hpp"

#include <algorithm>
#include <fstream>

#include "upright/base/error.hpp"

namespace upright {

namespace {

double read_parameter(const YamlMap& map, const ParameterInfo& info) {
  const std::string key(info.name);
  if (info.words.empty()) return map.number(key, info.range);
  const std::string word = map.choice(key, {info.words.begin(), info.words.end()});
  return static_cast<double>(std::find(info.words.begin(), info.words.end(), word) - info.words.begin());
}

PlantEffect read_effect(const YamlMap& map) {
  std::vector<std::string> kinds;
  for (const EffectInfo& info : effect_registry()) kinds.emplace_back(info.kind);
  PlantEffect effect{effect_number(map.choice("kind", kinds)), {}};
  const EffectInfo& info = effect_registry()[effect.number];
  for (std::size_t i = 0; i < info.parameters.size(); ++i)
    effect.values[i] = read_parameter(map, info.parameters[i]);
  map.finish();
  return effect;
}

Pendulum read_pendulum(const YamlMap& map) {
  Pendulum pendulum;
  pendulum.mass_kg = map.number("mass_kg", Range::positive());
  pendulum.length_to_com_m = map.number("length_to_com_m", Range::positive());
  pendulum.given_inertia_kgm2 = map.optional_number("inertia_about_pivot_kgm2", Range::positive());
  const double point_mass = pendulum.mass_kg * pendulum.length_to_com_m * pendulum.length_to_com_m;
  if (pendulum.given_inertia_kgm2 && *pendulum.given_inertia_kgm2 < point_mass * (1.0 - 1e-12))
    map.fail("inertia_about_pivot_kgm2", "is smaller than the inertia of a point mass",
             "set it to at least mass_kg length_to_com_m^2 = " + exact_text(point_mass));
  map.finish();
  return pendulum;
}

}  // namespace

std::string value_text(const ParameterInfo& parameter, double value) {
  const auto place = static_cast<std::size_t>(std::max(value, 0.0));
  return place < parameter.words.size() ? std::string(parameter.words[place]) : exact_text(value);
}

Plant read_plant(const YamlMap& document) {
  const YamlMap map = document.map("plant");
  Plant plant;
  plant.cart_mass_kg = map.number("cart_mass_kg", Range::positive());
  if (const auto pendulum = map.optional_map("pendulum")) plant.pendulum = read_pendulum(*pendulum);
  plant.gravity_mps2 = map.number("gravity_mps2", Range::not_negative());
  const YamlMap motor = map.map("motor");
  plant.motor.force_per_volt_n = motor.number("force_per_volt_n");
  plant.motor.back_emf_n_per_mps = motor.number("back_emf_n_per_mps", Range::not_negative());
  motor.finish();
  for (const YamlMap& item : map.maps("effects")) {
    const PlantEffect effect = read_effect(item);
    if (plant.find(effect.number) != nullptr)
      item.fail("kind", "appears twice", "keep one " + std::string(effect_registry()[effect.number].kind));
    plant.effects.push_back(effect);
  }
  const std::string fault = fault_of(plant);
  if (!fault.empty()) {
    const std::size_t colon = fault.find(": ");
    map.fail("effects", "cannot be simulated (" + fault.substr(0, colon) + ")", fault.substr(colon + 2));
  }
  map.finish();
  return plant;
}

Plant read_plant_file(const std::filesystem::path& file) {
  const YamlMap document = YamlMap::from_file(file);
  Plant plant = read_plant(document);
  document.finish();
  return plant;
}

std::string plant_text(const Plant& plant, const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) text += "# " + comment + "\n";
  text += "plant:\n  cart_mass_kg: " + exact_text(plant.cart_mass_kg) + "\n";
  if (plant.pendulum) {
    text += "  pendulum: {mass_kg: " + exact_text(plant.pendulum->mass_kg) +
            ", length_to_com_m: " + exact_text(plant.pendulum->length_to_com_m);
    if (plant.pendulum->given_inertia_kgm2)
      text += ", inertia_about_pivot_kgm2: " + exact_text(*plant.pendulum->given_inertia_kgm2);
    text += "}\n";
  }
  text += "  gravity_mps2: " + exact_text(plant.gravity_mps2) + "\n";
  text += "  motor: {force_per_volt_n: " + exact_text(plant.motor.force_per_volt_n) +
          ", back_emf_n_per_mps: " + exact_text(plant.motor.back_emf_n_per_mps) + "}\n";
  if (plant.effects.empty()) return text + "  effects: []\n";
  text += "  effects:\n";
  for (const PlantEffect& effect : plant.effects) {
    const EffectInfo& info = effect_registry()[effect.number];
    text += "    - {kind: " + std::string(info.kind);
    for (std::size_t i = 0; i < info.parameters.size(); ++i)
      text += ", " + std::string(info.parameters[i].name) + ": " +
              value_text(info.parameters[i], effect.values[i]);
    text += "}\n";
  }
  return text;
}

void write_plant_file(const Plant& plant, const std::filesystem::path& file,
                      const std::vector<std::string>& comments) {
  std::ofstream out(file);
  out << plant_text(plant, comments);
  out.close();
  if (!out)
    throw Error(ExitCode::usage, "cannot write " + file.string() + ": check the folder and its free space");
}

}  // namespace upright
