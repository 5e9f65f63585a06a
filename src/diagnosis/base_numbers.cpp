#include "base_numbers.hpp"

#include <algorithm>
#include <cmath>

#include "phases.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

namespace {

/// Puts the scale of a base parameter into the plant's own numbers.
void fold(Plant& plant, std::size_t effect, double scale) {
  Plant scaled = plant;
  scaled.set(effect, std::vector<double>{scale});
  const BaseParameters<double> base = make_model<double>(scaled).corrected();
  plant.cart_mass_kg = base.cart_mass_kg;
  plant.motor.back_emf_n_per_mps = base.back_emf_n_per_mps;
  if (!plant.pendulum) return;
  const bool rod = !plant.pendulum->given_inertia_kgm2;
  plant.pendulum->mass_kg = base.pendulum_mass_kg;
  plant.pendulum->length_to_com_m = base.length_to_com_m;
  if (!rod) plant.pendulum->given_inertia_kgm2 = base.inertia_about_pivot_kgm2;
}

/// Of a 95 percent interval, in standard deviations.
constexpr double half_width = 1.96;

/// Of an inertia m a^2: of a mass, and of a length squared.
const double inertia_share = std::sqrt(1.0 + 2.0 * 2.0);

}  // namespace

Plant model_with(const Plant& given, const Plant& fitted, const std::vector<std::size_t>& nuisances,
                 const std::vector<std::size_t>& listed) {
  Plant model = given;
  for (const std::size_t effect : nuisances) {
    if (std::find(listed.begin(), listed.end(), effect) != listed.end()) continue;
    if (given.find(effect) != nullptr) {
      model.set(effect, fitted.find(effect)->values);
    } else if (effect_registry()[effect].enters == Enters::parameter) {
      fold(model, effect, fitted.find(effect)->values[0]);
    }
  }
  for (const std::size_t effect : listed) model.set(effect, fitted.find(effect)->values);
  wrap_phases(model);
  return model;
}

std::vector<MovedNumber> moved_numbers(const Plant& given, const Plant& model, const DataRange& range,
                                       const PriorPolicy& prior) {
  constexpr double min_share = 1e-3;
  std::vector<MovedNumber> moved;
  const auto note = [&](const std::string& name, std::string_view unit, double file, double fitted,
                        double sigma) {
    if (std::abs(fitted - file) <= min_share * std::abs(file)) return;
    moved.push_back(
        {name, std::string(unit), file, fitted, file - half_width * sigma, file + half_width * sigma});
  };
  const BaseParameters<double> was = make_model<double>(given).corrected(),
                               is = make_model<double>(model).corrected();
  const auto note_base = [&](const std::string& name, std::string_view unit, double file, double fitted,
                             double share) {
    note(name, unit, file, fitted, share * prior.base_parameter * std::abs(file));
  };
  note_base("cart_mass_kg", "kg", was.cart_mass_kg, is.cart_mass_kg, 1.0);
  note_base("motor.back_emf_n_per_mps", "N/(m/s)", was.back_emf_n_per_mps, is.back_emf_n_per_mps, 1.0);
  if (given.pendulum) {
    note_base("pendulum.mass_kg", "kg", was.pendulum_mass_kg, is.pendulum_mass_kg, 1.0);
    note_base("pendulum.length_to_com_m", "m", was.length_to_com_m, is.length_to_com_m, 1.0);
    if (given.pendulum->given_inertia_kgm2)
      note_base("pendulum.inertia_about_pivot_kgm2", "kg m^2", was.inertia_about_pivot_kgm2,
                is.inertia_about_pivot_kgm2, inertia_share);
  }
  for (const PlantEffect& effect : given.effects) {
    const EffectInfo& info = effect_registry()[effect.number];
    if (info.enters == Enters::parameter || model.find(effect.number) == nullptr) continue;
    for (const FreeParameter& p : correction_parameters(given, effect.number, range, prior))
      note(std::string(info.kind) + "." + std::string(info.parameters[p.index].name),
           info.parameters[p.index].unit, p.prior_mean, model.find(effect.number)->values[p.index],
           p.prior_sigma);
  }
  return moved;
}

}  // namespace upright
