// A plant as described by its file: rigid body, motor and effects. Plain data.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "upright/model/registry.hpp"

namespace upright {

/// The pendulum of a plant.
struct Pendulum {
  double mass_kg = 0.0;          ///< mass [kg]
  double length_to_com_m = 0.0;  ///< pivot to centre of mass
  /// About the pivot. Absent: a uniform rod, 4/3 m l^2.
  std::optional<double> given_inertia_kgm2;

  /// The given inertia, or that of a uniform rod [kg m^2].
  double inertia_about_pivot_kgm2() const {
    return given_inertia_kgm2.value_or(4.0 / 3.0 * mass_kg * length_to_com_m * length_to_com_m);
  }
};

/// Force of the motor on the cart: force_per_volt V - back_emf v (paper, equation (2)).
struct Motor {
  double force_per_volt_n = 0.0;    ///< force per volt [N/V]
  double back_emf_n_per_mps = 0.0;  ///< force per velocity [N s/m]
};

/// One effect of a plant: its index in the registry and its parameter values in declared order.
struct PlantEffect {
  std::size_t number = 0;                              ///< index in the registry
  std::array<double, max_effect_parameters> values{};  ///< in declared order; the rest is unused
};

/// Whether an effect is a level of dry friction. Of a force table its values decide.
bool is_dry(const PlantEffect& effect);

/// Whether an effect attaches a mass with a motion of its own to the plant (attached_mass.hpp).
bool attaches_mass(std::size_t effect);

/// Whether an effect has no meaning without a pendulum.
bool needs_pendulum(std::size_t effect);

/// Rigid body, motor and effects.
struct Plant {
  double cart_mass_kg = 0.0;         ///< of the cart alone [kg]
  std::optional<Pendulum> pendulum;  ///< absent: the cart alone
  double gravity_mps2 = 9.8;         ///< acceleration of gravity [m/s^2]
  Motor motor;                       ///< between voltage and force
  std::vector<PlantEffect> effects;  ///< each kind at most once

  /// The effect of this number; null: the plant has none.
  const PlantEffect* find(std::size_t effect) const;
  /// The effect of this kind; null: the plant has none.
  const PlantEffect* find(std::string_view kind) const { return find(effect_number(kind)); }
  /// Adds an effect, or replaces the values of an existing one.
  void set(std::size_t effect, std::span<const double> values);
  /// The same by the kind's name.
  void set(std::string_view kind, std::initializer_list<double> values) {
    set(effect_number(kind), std::span<const double>(values.begin(), values.size()));
  }
  void remove(std::size_t effect);  ///< removes an effect, if it is there
};

/// The fault of a plant as a whole, "CAUSE: REMEDY"; empty when it can be simulated.
std::string fault_of(const Plant& plant);

}  // namespace upright
