#include "physical_limits.hpp"

#include <cmath>
#include <numbers>

#include "delay_margin.hpp"
#include "model/dense_algebra.hpp"
#include "model/linear_plant.hpp"
#include "upright/base/error.hpp"

namespace upright {

PhysicalLimits physical_limits(const Plant& plant) {
  if (!plant.pendulum)
    throw ConfigError("the plant has no pendulum to balance: name a plant file with a pendulum");
  constexpr double any_smoothing = 1.0;  // no dry level is left to smooth
  const LinearPlant linear = linearize(large_motion_plant(plant), any_smoothing);
  PhysicalLimits limits;
  const Pendulum& pendulum = *plant.pendulum;
  limits.unstable_rate_radps = std::sqrt(pendulum.mass_kg * plant.gravity_mps2 * pendulum.length_to_com_m /
                                         pendulum.inertia_about_pivot_kgm2());
  limits.plant_pole_radps = eigenvalues(linear.a).real().maxCoeff();
  limits.proportional_derivative_s = std::numbers::sqrt2 / limits.unstable_rate_radps;
  limits.with_acceleration_s = 2.0 / limits.unstable_rate_radps;
  limits.linear_controller_s = 2.0 / limits.plant_pole_radps;
  return limits;
}

}  // namespace upright
