// Swing-up and catch on plants that are not quite the one planned with: every parameter off by up to 5
// percent, stick-slip friction, encoders' steps, +-10 V and +-0.35 m.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <random>

#include "experiment/experiment.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

const std::filesystem::path config = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config";

Plant changed(Plant plant, std::mt19937_64& random) {
  std::uniform_real_distribution<double> off(0.95, 1.05);
  for (double* number : {&plant.cart_mass_kg, &plant.pendulum->mass_kg, &plant.pendulum->length_to_com_m,
                         &plant.motor.force_per_volt_n, &plant.motor.back_emf_n_per_mps})
    *number *= off(random);
  for (PlantEffect& effect : plant.effects)
    for (double& value : effect.values) value *= off(random);
  return plant;
}

class SwingUp : public ::testing::TestWithParam<const char*> {};

TEST_P(SwingUp, CatchesAndBalancesInNearlyEveryTrial) {
  ExperimentSetup setup;
  setup.experiment = read_experiment_text(
      "experiment:\n  name: swing-up\n  why: a test\n  gains: ../gains/exponential.yaml\n  travel_m: 0.34\n"
      "  voltage_limit_v: 10\n  pieces:\n"
      "    - {kind: closed_loop, set_points_m: [0], hold_s: 8, start: swing_up}\n",
      config / "experiments" / "swing-up.yaml");
  setup.rig = read_rig_file(config / "rigs" / "simulated.yaml");
  setup.rig.amplifier.limit_v = 10.0;
  setup.plant = read_plant_file(config / "plants" / GetParam());
  setup.control = read_gain_file(config / "gains" / "exponential.yaml");
  constexpr int trials = 100;
  int caught = 0;
  double farthest_m = 0.0;
  for (int seed = 1; seed <= trials; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    const Rehearsal r = rehearse(setup.experiment.pieces.front(), setup, changed(setup.plant, random));
    farthest_m = std::max(farthest_m, r.farthest_m);
    if (r.outcome.reason == StopReason::duration) ++caught;
  }
  std::printf("%s: %d of %d caught and balanced, cart within %.3f m\n", GetParam(), caught, trials,
              farthest_m);
  EXPECT_GE(caught, 95);
  EXPECT_LT(farthest_m, 0.35);
}

INSTANTIATE_TEST_SUITE_P(Plants, SwingUp, ::testing::Values("exponential.yaml", "dynamic.yaml"));

}  // namespace
}  // namespace upright
