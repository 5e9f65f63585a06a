#include "uncertain_parameters.hpp"

#include <utility>

namespace upright {

namespace {

/// A parameter on which no other depends.
template <class Place>
UncertainParameter alone(std::string name, double value, const Range& range, Place place) {
  return {std::move(name), value, range, [place](Plant& p, double by) { place(p) *= by; },
          [place](Plant& p, double to) { place(p) = to; }};
}

/// A parameter of the pendulum, above zero, which may carry the inertia along.
UncertainParameter of_pendulum(std::string name, double value,
                               const std::function<void(Plant&, double)>& scale) {
  const auto set = [scale, value](Plant& p, double to) { scale(p, to / value); };
  return {"pendulum " + std::move(name), value, Range::positive(), scale, set};
}

}  // namespace

std::vector<UncertainParameter> uncertain_parameters(const Plant& plant) {
  std::vector<UncertainParameter> parameters{
      alone("cart_mass_kg", plant.cart_mass_kg, Range::positive(),
            [](Plant& p) -> double& { return p.cart_mass_kg; }),
      alone("motor force_per_volt_n", plant.motor.force_per_volt_n, Range::any(),
            [](Plant& p) -> double& { return p.motor.force_per_volt_n; }),
      alone("motor back_emf_n_per_mps", plant.motor.back_emf_n_per_mps, Range::not_negative(),
            [](Plant& p) -> double& { return p.motor.back_emf_n_per_mps; })};
  if (plant.pendulum) {
    parameters.push_back(of_pendulum("mass_kg", plant.pendulum->mass_kg, [](Plant& p, double by) {
      p.pendulum->given_inertia_kgm2 = p.pendulum->inertia_about_pivot_kgm2() * by;
      p.pendulum->mass_kg *= by;
    }));
    parameters.push_back(
        of_pendulum("length_to_com_m", plant.pendulum->length_to_com_m, [](Plant& p, double by) {
          p.pendulum->given_inertia_kgm2 = p.pendulum->inertia_about_pivot_kgm2() * by * by;
          p.pendulum->length_to_com_m *= by;
        }));
    parameters.push_back(of_pendulum(
        "inertia_about_pivot_kgm2", plant.pendulum->inertia_about_pivot_kgm2(), [](Plant& p, double by) {
          p.pendulum->given_inertia_kgm2 = p.pendulum->inertia_about_pivot_kgm2() * by;
        }));
  }
  for (std::size_t i = 0; i < plant.effects.size(); ++i) {
    const auto& entry = effect_registry()[plant.effects[i].number];
    for (std::size_t j = 0; j < entry.parameters.size(); ++j)
      if (entry.parameters[j].words.empty())
        parameters.push_back(alone(std::string(entry.kind) + " " + std::string(entry.parameters[j].name),
                                   plant.effects[i].values[j], entry.parameters[j].range,
                                   [i, j](Plant& p) -> double& { return p.effects[i].values[j]; }));
  }
  return parameters;
}

}  // namespace upright
