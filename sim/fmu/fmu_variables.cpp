#include "fmu_variables.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

namespace upright {

namespace {

/// A number of the rigid body, the motor or the initial state.
struct PlainParameter {
  unsigned reference;
  const char* name;
  const char* unit;
  const char* description;
  bool of_pendulum;
  double* (*find)(FmuPlant&);
};

double* inertia_of(FmuPlant& p) {
  Pendulum& pendulum = *p.plant.pendulum;
  if (!pendulum.given_inertia_kgm2) pendulum.given_inertia_kgm2 = pendulum.inertia_about_pivot_kgm2();
  return &*pendulum.given_inertia_kgm2;
}

constexpr std::array plain_parameters = {
    PlainParameter{10, "cart_mass_kg", "kg", "mass of the cart", false,
                   [](FmuPlant& p) { return &p.plant.cart_mass_kg; }},
    PlainParameter{11, "gravity_mps2", "m/s2", "acceleration of gravity", false,
                   [](FmuPlant& p) { return &p.plant.gravity_mps2; }},
    PlainParameter{12, "force_per_volt_n", "N/V", "force of the motor per volt", false,
                   [](FmuPlant& p) { return &p.plant.motor.force_per_volt_n; }},
    PlainParameter{13, "back_emf_n_per_mps", "N.s/m", "force lost per velocity by back-EMF", false,
                   [](FmuPlant& p) { return &p.plant.motor.back_emf_n_per_mps; }},
    PlainParameter{14, "pendulum_mass_kg", "kg", "mass of the pendulum", true,
                   [](FmuPlant& p) { return &p.plant.pendulum->mass_kg; }},
    PlainParameter{15, "length_to_com_m", "m", "from the pivot to the centre of mass", true,
                   [](FmuPlant& p) { return &p.plant.pendulum->length_to_com_m; }},
    PlainParameter{16, "inertia_about_pivot_kgm2", "kg.m2", "inertia of the pendulum about its pivot", true,
                   inertia_of},
    PlainParameter{20, "initial_cart_m", "m", "cart position at the start", false,
                   [](FmuPlant& p) { return &p.cart_m; }},
    PlainParameter{21, "initial_cart_velocity_mps", "m/s", "cart velocity at the start", false,
                   [](FmuPlant& p) { return &p.cart_velocity_mps; }},
    PlainParameter{22, "initial_theta_rad", "rad", "pendulum angle at the start: 0 upright, pi hanging", true,
                   [](FmuPlant& p) { return &p.theta_rad; }},
    PlainParameter{23, "initial_pendulum_rate_radps", "rad/s", "pendulum rate at the start", true,
                   [](FmuPlant& p) { return &p.pendulum_rate_radps; }},
};

constexpr unsigned first_effect_reference = 100;

/// As `name.parameter` in the model description and in the plant's text.
std::string effect_parameter_name(const EffectInfo& info, std::size_t index) {
  return std::string(info.kind) + "." + std::string(info.parameters[index].name);
}

std::string shortest(double value) {
  std::array<char, 40> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

/// Sets the parameter of this name; an effect that is not there yet is added.
bool set_parameter(FmuPlant& plant, std::string_view name, double value) {
  for (const PlainParameter& p : plain_parameters)
    if (name == p.name) {
      if (p.of_pendulum && !plant.plant.pendulum) plant.plant.pendulum.emplace();
      *p.find(plant) = value;
      return true;
    }
  const std::size_t dot = name.find('.');
  const std::size_t effect = effect_number(name.substr(0, dot));
  if (dot == std::string_view::npos || effect == effect_count) return false;
  if (plant.plant.find(effect) == nullptr) plant.plant.effects.push_back({effect, {}});
  const EffectInfo& info = effect_registry()[effect];
  for (PlantEffect& there : plant.plant.effects)
    for (std::size_t i = 0; there.number == effect && i < info.parameters.size(); ++i)
      if (name.substr(dot + 1) == info.parameters[i].name) {
        there.values[i] = value;
        return true;
      }
  return false;
}

}  // namespace

std::vector<FmuVariable> fmu_variables(const Plant& plant) {
  const bool pendulum = plant.pendulum.has_value();
  const auto output = [](FmuOutput which) { return static_cast<unsigned>(which); };
  std::vector<FmuVariable> list = {{fmu_voltage_reference, FmuCausality::input, "voltage_v", "V",
                                    "voltage of the amplifier, held over a step"},
                                   {output(FmuOutput::cart_m), FmuCausality::output, "cart_m", "m",
                                    "cart position as its sensor shows it"}};
  if (pendulum)
    list.push_back({output(FmuOutput::theta_rad), FmuCausality::output, "theta_rad", "rad",
                    "pendulum angle as its sensor shows it: 0 upright"});
  list.push_back({output(FmuOutput::cart_velocity_mps), FmuCausality::output, "cart_velocity_mps", "m/s",
                  "velocity of the cart"});
  if (pendulum)
    list.push_back({output(FmuOutput::pendulum_rate_radps), FmuCausality::output, "pendulum_rate_radps",
                    "rad/s", "angular velocity of the pendulum"});
  list.push_back({output(FmuOutput::motor_force_n), FmuCausality::output, "motor_force_n", "N",
                  "force of the motor on the cart, with back-EMF"});
  list.push_back({output(FmuOutput::other_force_n), FmuCausality::output, "other_force_n", "N",
                  "friction and all other forces of the effects on the cart"});
  for (const PlainParameter& p : plain_parameters)
    if (pendulum || !p.of_pendulum)
      list.push_back({p.reference, FmuCausality::parameter, p.name, p.unit, p.description});
  for (const PlantEffect& effect : plant.effects) {
    const EffectInfo& info = effect_registry()[effect.number];
    for (std::size_t i = 0; i < info.parameters.size(); ++i)
      list.push_back(
          {first_effect_reference + static_cast<unsigned>(effect_parameter_offset(effect.number) + i),
           FmuCausality::parameter, effect_parameter_name(info, i), std::string(info.parameters[i].unit),
           std::string(info.parameters[i].meaning)});
  }
  return list;
}

double* fmu_parameter(FmuPlant& plant, unsigned reference) {
  for (const PlainParameter& p : plain_parameters)
    if (p.reference == reference) return p.of_pendulum && !plant.plant.pendulum ? nullptr : p.find(plant);
  for (PlantEffect& effect : plant.plant.effects) {
    const std::size_t first = first_effect_reference + effect_parameter_offset(effect.number);
    if (reference >= first && reference < first + effect_registry()[effect.number].parameters.size())
      return &effect.values[reference - first];
  }
  return nullptr;
}

std::string fmu_plant_text(const FmuPlant& plant) {
  FmuPlant copy = plant;
  std::string text;
  for (const FmuVariable& variable : fmu_variables(plant.plant))
    if (variable.causality == FmuCausality::parameter)
      text += variable.name + " " + shortest(*fmu_parameter(copy, variable.reference)) + "\n";
  return text;
}

std::optional<FmuPlant> fmu_plant_of(const std::string& text) {
  FmuPlant plant;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n'), space = rest.find(' ');
    if (end == std::string_view::npos || space >= end) return std::nullopt;
    double value = 0.0;
    const auto read = std::from_chars(rest.data() + space + 1, rest.data() + end, value);
    if (read.ec != std::errc{} || read.ptr != rest.data() + end) return std::nullopt;
    if (!set_parameter(plant, rest.substr(0, space), value)) return std::nullopt;
    rest.remove_prefix(end + 1);
  }
  return plant;
}

std::string fault_of_parameters(const FmuPlant& plant) {
  const Plant& p = plant.plant;
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  if (!positive(p.cart_mass_kg)) return "cart_mass_kg must be above 0";
  if (!std::isfinite(p.motor.force_per_volt_n)) return "force_per_volt_n must be finite";
  if (!(p.gravity_mps2 >= 0.0) || !std::isfinite(p.gravity_mps2)) return "gravity_mps2 must not be negative";
  if (!(p.motor.back_emf_n_per_mps >= 0.0) || !std::isfinite(p.motor.back_emf_n_per_mps))
    return "back_emf_n_per_mps must not be negative";
  if (p.pendulum) {
    const Pendulum& rod = *p.pendulum;
    if (!positive(rod.mass_kg) || !positive(rod.length_to_com_m))
      return "pendulum_mass_kg and length_to_com_m must be above 0";
    constexpr double rounding = 1e-12;
    if (!(rod.inertia_about_pivot_kgm2() >=
          rod.mass_kg * rod.length_to_com_m * rod.length_to_com_m * (1.0 - rounding)) ||
        !std::isfinite(rod.inertia_about_pivot_kgm2()))
      return "inertia_about_pivot_kgm2 must be at least pendulum_mass_kg length_to_com_m^2";
  }
  for (const double state :
       {plant.cart_m, plant.theta_rad, plant.cart_velocity_mps, plant.pendulum_rate_radps})
    if (!std::isfinite(state)) return "the initial state must be finite";
  for (const PlantEffect& effect : p.effects) {
    const EffectInfo& info = effect_registry()[effect.number];
    for (std::size_t i = 0; i < info.parameters.size(); ++i)
      if (!std::isfinite(effect.values[i]) || !info.parameters[i].range.contains(effect.values[i]))
        return effect_parameter_name(info, i) + " is out of its range";
  }
  return fault_of(p);
}

}  // namespace upright
