// A number of the plant file that is held stays as uncertain as it was believed to be.
#include <gtest/gtest.h>

#include <cmath>

#include "blind_case.hpp"
#include "diagnosis/search.hpp"

namespace upright {
namespace {

const std::size_t pendulum_mass = effect_number("pendulum_mass");
const std::size_t dry = effect_number("pivot_coulomb_friction");

Plant pendulum_on_a_locked_cart() {
  Plant plant;
  plant.cart_mass_kg = 0.8;
  plant.motor = {1.7, 7.7};
  plant.pendulum = Pendulum{0.2, 0.3, {}};
  return plant;
}

Measurement swing(double torque_nm) {
  blind::Rig rig{.plant = pendulum_on_a_locked_cart()};
  rig.plant.set(dry, std::vector<double>{torque_nm});
  blind::Plan plan;
  plan.experiment = blind::Experiment::locked_swing;
  plan.rate_hz = 200.0;
  plan.duration_s = 6.0;
  plan.swing_rad = 0.6;
  return measure(rig, plan, "swing");
}

/// The mass divides out of a pendulum's motion on a locked cart. So these data say nothing of it, and the
/// torque that they show is as uncertain as the mass.
TEST(HeldNumber, IsAsUncertainAsBelieved) {
  constexpr double torque_nm = 0.003;
  const SelectionPolicy policy;
  const SearchBudget budget;
  const std::vector<Measurement> runs = {swing(torque_nm)};
  const FitData train{&runs, cut_segments(runs)}, held{&runs, {}};
  Search search(pendulum_on_a_locked_cart(), runs, train, held, policy, budget);
  const auto with_friction = [&] {
    Hypothesis base = search.baseline();
    base.train.point.plant.set(dry, std::vector<double>{0.5 * torque_nm});
    return search.fitted_separately({dry}, base, nullptr, true);
  };
  const Hypothesis free = with_friction();
  EXPECT_EQ(search.covariance_from_held_numbers(train, free).norm(), 0.0) << "nothing is held";

  search.hold(pendulum_mass);
  const Hypothesis fitted = with_friction();
  const Eigen::MatrixXd added = search.covariance_from_held_numbers(train, fitted);
  ASSERT_EQ(added.rows(), static_cast<Eigen::Index>(fitted.free.size()));
  for (std::size_t j = 0; j < fitted.free.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const FreeParameter& p = fitted.free[j];
    EXPECT_NE(p.effect, pendulum_mass);
    if (p.effect != dry) continue;
    const double value = fitted.train.point.plant.find(dry)->values[p.index];
    EXPECT_NEAR(std::sqrt(added(at, at)), policy.prior.base_parameter * value,
                0.02 * policy.prior.base_parameter * value);
    EXPECT_LT(std::sqrt(fitted.train.covariance(at, at)), 0.2 * policy.prior.base_parameter * value)
        << "alone, the fit is as certain as if the mass were known";
  }
}

}  // namespace
}  // namespace upright
