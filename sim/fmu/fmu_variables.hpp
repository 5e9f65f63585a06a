// The variables of a plant as an FMU (functional mock-up unit): voltage in, motion and forces out, every
// number of the plant file as a parameter.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "upright/model/plant.hpp"

namespace upright {

/// What an FMU simulates: a plant from an initial state.
struct FmuPlant {
  Plant plant;
  double cart_m = 0.0, theta_rad = 0.0, cart_velocity_mps = 0.0, pendulum_rate_radps = 0.0;  ///< initial
};

enum class FmuCausality { input, output, parameter };

struct FmuVariable {
  unsigned reference = 0;  ///< by which importers name it; the same for every plant
  FmuCausality causality = FmuCausality::parameter;
  std::string name, unit, description;
};

/// Outputs by their reference.
enum class FmuOutput : unsigned {
  cart_m = 1,
  theta_rad,
  cart_velocity_mps,
  pendulum_rate_radps,
  motor_force_n,
  other_force_n,
};
inline constexpr unsigned fmu_voltage_reference = 0;

/// In the order of a model description. A plant without a pendulum has none of its variables.
std::vector<FmuVariable> fmu_variables(const Plant& plant);

/// A parameter of the plant; null where it has none with this reference.
double* fmu_parameter(FmuPlant& plant, unsigned reference);

/// The plant as the lines `NAME VALUE` of its parameters, and back. Empty for a text that is none.
std::string fmu_plant_text(const FmuPlant& plant);
std::optional<FmuPlant> fmu_plant_of(const std::string& text);

/// What is wrong with the values of the parameters, in one sentence; empty if nothing is.
std::string fault_of_parameters(const FmuPlant& plant);

}  // namespace upright
