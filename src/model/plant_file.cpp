#include "upright/model/plant_file.hpp"

#include <algorithm>
#include <fstream>

#include "plant_keys.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

void parameter_key(YamlKeys& keys, const ParameterInfo& info, double& value) {
  const std::string key(info.name);
  if (info.words.empty()) {
    keys.number(key.c_str(), value, info.range);
  } else {
    auto word = static_cast<std::size_t>(std::max(value, 0.0));
    keys.one_of(key.c_str(), word, {info.words.begin(), info.words.end()});
    value = static_cast<double>(word);
  }
  keys.describe(key.c_str(),
                std::string(info.meaning) + (info.unit.empty() ? "" : " [" + std::string(info.unit) + "]"));
}

void effect_keys(YamlKeys& keys, PlantEffect& effect) {
  std::vector<std::string> kinds;
  for (const EffectInfo& info : effect_registry()) kinds.emplace_back(info.kind);
  keys.one_of("kind", effect.number, kinds);
  const EffectInfo& info = effect_registry()[effect.number];
  for (std::size_t i = 0; i < info.parameters.size(); ++i)
    parameter_key(keys, info.parameters[i], effect.values[i]);
  if (const YamlMap* map = keys.source()) map->finish();
}

void pendulum_keys(YamlKeys& keys, Pendulum& pendulum) {
  keys.number("mass_kg", pendulum.mass_kg, Range::positive());
  keys.number("length_to_com_m", pendulum.length_to_com_m, Range::positive());
  keys.optional_number("inertia_about_pivot_kgm2", pendulum.given_inertia_kgm2, Range::positive());
  const double point_mass = pendulum.mass_kg * pendulum.length_to_com_m * pendulum.length_to_com_m;
  keys.check("inertia_about_pivot_kgm2",
             !pendulum.given_inertia_kgm2 || *pendulum.given_inertia_kgm2 >= point_mass * (1.0 - 1e-12),
             "is smaller than the inertia of a point mass",
             "set it to at least mass_kg length_to_com_m^2 = " + exact_text(point_mass));
}

void refuse_what_cannot_be_simulated(const YamlMap& map, const Plant& plant) {
  const std::string fault = fault_of(plant);
  if (fault.empty()) return;
  const std::size_t colon = fault.find(": ");
  map.fail("effects", "cannot be simulated (" + fault.substr(0, colon) + ")", fault.substr(colon + 2));
}

/// How many effects of the plant are of this kind.
std::ptrdiff_t count_of(const Plant& plant, std::size_t number) {
  return std::count_if(plant.effects.begin(), plant.effects.end(),
                       [number](const PlantEffect& effect) { return effect.number == number; });
}

}  // namespace

std::string value_text(const ParameterInfo& parameter, double value) {
  const auto place = static_cast<std::size_t>(std::max(value, 0.0));
  return place < parameter.words.size() ? std::string(parameter.words[place]) : exact_text(value);
}

void plant_keys(YamlKeys& document, Plant& plant) {
  document.section("plant", [&plant](YamlKeys& keys) {
    keys.number("cart_mass_kg", plant.cart_mass_kg, Range::positive());
    keys.optional_map("pendulum", plant.pendulum, pendulum_keys);
    keys.number("gravity_mps2", plant.gravity_mps2, Range::not_negative());
    keys.map("motor", [&plant](YamlKeys& motor) {
      motor.number("force_per_volt_n", plant.motor.force_per_volt_n, Range::any());
      motor.number("back_emf_n_per_mps", plant.motor.back_emf_n_per_mps, Range::not_negative());
    });
    keys.items("effects", plant.effects, [&plant](YamlKeys& item, PlantEffect& effect) {
      effect_keys(item, effect);
      item.check("kind", count_of(plant, effect.number) == 1, "appears twice",
                 "keep one " + std::string(effect_registry()[effect.number].kind));
    });
    if (const YamlMap* map = keys.source()) refuse_what_cannot_be_simulated(*map, plant);
  });
}

void plant_file_keys(YamlKeys& document, PlantFile& file) {
  plant_keys(document, file.plant);
  if (!document.given("intervals", !file.intervals.empty())) return;
  document.items("intervals", file.intervals, [](YamlKeys& item, NumberInterval& interval) {
    item.text("number", interval.number);
    item.number("low", interval.low, Range::any());
    item.number("high", interval.high, Range::any());
    item.check("high", interval.high >= interval.low, "is below low",
               "set it to at least " + exact_text(interval.low));
  });
}

Plant read_plant(const YamlMap& document) {
  Plant plant;
  YamlKeyReader reader(document);
  plant_keys(reader, plant);
  return plant;
}

namespace {

PlantFile read_whole_file(const std::filesystem::path& file) {
  const YamlMap document = YamlMap::from_file(file);
  PlantFile whole;
  YamlKeyReader reader(document);
  plant_file_keys(reader, whole);
  document.finish();
  return whole;
}

}  // namespace

Plant read_plant_file(const std::filesystem::path& file) {
  return read_whole_file(file).plant;
}

std::vector<NumberInterval> read_plant_intervals(const std::filesystem::path& file) {
  return read_whole_file(file).intervals;
}

std::string plant_text(const Plant& plant, const std::vector<std::string>& comments,
                       const std::vector<NumberInterval>& intervals) {
  std::string text;
  for (const std::string& comment : comments) text += "# " + comment + "\n";
  PlantFile copy{plant, intervals};
  YamlKeyWriter writer(YamlKeyWriter::Layout::lines);
  plant_file_keys(writer, copy);
  return text + writer.written();
}

void write_plant_file(const Plant& plant, const std::filesystem::path& file,
                      const std::vector<std::string>& comments,
                      const std::vector<NumberInterval>& intervals) {
  std::ofstream out(file);
  out << plant_text(plant, comments, intervals);
  out.close();
  if (!out)
    throw Error(ExitCode::usage, "cannot write " + file.string() + ": check the folder and its free space");
}

}  // namespace upright
