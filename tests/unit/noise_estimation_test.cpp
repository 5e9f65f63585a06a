// Objectives of several noises side by side, against the filter that follows the data with one noise.
#include "estimation/noise_estimation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "blind_case.hpp"

namespace upright {
namespace {

/// Reversals at a voltage that hardly overcomes friction: the cart rests, creeps and slides.
std::vector<Measurement> hunting_run(const Plant& plant) {
  blind::Rig rig{.plant = plant, .disturbance_n = 0.03, .jitter_s = 3e-4};
  blind::Plan plan;
  plan.experiment = blind::Experiment::square;
  plan.rate_hz = 250.0;
  plan.duration_s = 6.0;
  plan.amplitude_v = 0.5;
  return {measure(rig, plan, "run")};
}

Plant cart_with_friction() {
  Plant plant;
  plant.cart_mass_kg = 1.0;
  plant.motor = {1.5, 6.6};
  plant.set("viscous_friction", {2.8});
  plant.set("coulomb_friction", {0.41});
  return plant;
}

class NoiseObjectives : public testing::Test {
 protected:
  double objective_of_filter(const Noise& noise) {
    const FitPoint point{plant_, starts_, noise};
    linearised_.resize(data_.segments.size());
    double sum = 0.0;
    for (std::size_t s = 0; s < data_.segments.size(); ++s) {
      linearise_segment(data_, s, point, {}, linearised_[s].steps, &linearised_[s].normal);
      sum += linearised_[s].normal.likelihood.objective();
    }
    return sum;
  }

  const Plant plant_ = cart_with_friction();
  const std::vector<Measurement> runs_ = hunting_run(plant_);
  const FitData data_{&runs_, cut_segments(runs_)};
  const std::vector<PlantState<double>> starts_ = estimate_initial_states(runs_, data_.segments, plant_);
  std::vector<LinearisedSegment> linearised_;
};

TEST_F(NoiseObjectives, AreThoseOfTheFilterWithOneNoise) {
  for (const Noise& noise : {Noise{.force = 1e-3}, Noise{.force = 0.05, .sensors = 1.2, .jitter_s = 1e-4},
                             Noise{.force = 1.0, .torque = 0.1}, Noise{.force = 0.0, .sensors = 2.0},
                             Noise{.force = 0.02, .coloured_force_n = 0.1, .correlation_s = 0.3}}) {
    const double objective = objective_of_filter(noise);
    ASSERT_TRUE(std::isfinite(objective));
    const double side_by_side = noise_objectives(data_, plant_, linearised_, {noise}).front();
    EXPECT_NEAR(side_by_side, objective, 1e-7 * std::abs(objective)) << noise.force;
  }
}

TEST_F(NoiseObjectives, DoNotDependOnTheirNeighbours) {
  objective_of_filter({.force = 0.05});
  std::vector<Noise> noises;
  for (int i = 0; i < 37; ++i) noises.push_back({.force = 0.001 * i, .sensors = 1.0 + 0.1 * i});
  const std::vector<double> together = noise_objectives(data_, plant_, linearised_, noises);
  for (const std::size_t i : {0, 1, 15, 16, 36})
    EXPECT_EQ(noise_objectives(data_, plant_, linearised_, {noises[i]}).front(), together[i]) << i;
}

}  // namespace
}  // namespace upright
