// Whatever plant the rig really is, the guard keeps the cart within its travel: the plan is made with another
// plant than the one that moves.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "experiment/experiment.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

const std::filesystem::path config = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config";

Plant changed(Plant plant, std::mt19937_64& random) {
  std::uniform_real_distribution<double> part(0.75, 1.3);
  plant.cart_mass_kg *= part(random);
  plant.motor.force_per_volt_n *= part(random);
  plant.motor.back_emf_n_per_mps *= part(random);
  for (PlantEffect& effect : plant.effects) effect.values[0] *= part(random);
  return plant;
}

class Travel : public ::testing::TestWithParam<const char*> {};

TEST_P(Travel, IsKeptOnPlantsThatDifferFromThePlan) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 8; ++i) {
    ExperimentSetup setup;
    setup.experiment = read_experiment_text(
        std::string("experiment:\n  name: test\n  why: a test\n  travel_m: 0.25\n  voltage_limit_v: 10\n"
                    "  pieces:\n    - ") +
            GetParam() + "\n",
        config / "experiments" / "test.yaml");
    setup.rig = read_rig_file(config / "rigs" / "simulated.yaml");
    setup.rig.amplifier.limit_v = 10.0;
    setup.control.sample_rate_hz = 1000.0;
    const Plant plan = read_plant_file(config / "plants" / "exponential.yaml");
    setup.plant = plan;
    const Piece piece = plan_pieces(setup).front();
    const Rehearsal r = rehearse(piece, setup, changed(plan, random));
    EXPECT_EQ(r.outcome.reason, StopReason::duration) << name_of(r.outcome.reason);
    EXPECT_LT(r.farthest_m, 0.25 + 0.02);
    for (const LogRecord& row : r.rows) ASSERT_LE(std::abs(row.voltage_v), 10.0);
    // Back in the middle, as near as the calming of the pendulum and bristles leave it.
    EXPECT_LT(std::abs(r.rows.back().cart_m), 0.013);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Pieces, Travel,
    ::testing::Values(
        "{kind: ramp, rate_v_per_s: 0.3}", "{kind: constant_voltage, voltages_v: [1, 4]}",
        "{kind: coast, voltages_v: [2, 5], push_s: 0.5}",
        "{kind: square_wave, amplitude_v: 8, period_s: 1.2, duration_s: 5, fit_to_travel: true}",
        "{kind: multisine, amplitude_v: 9, lowest_hz: 0.2, highest_hz: 8, duration_s: 6, "
        "fit_to_travel: true}",
        "{kind: slow_sine, amplitude_m: 0.15, period_s: 8, duration_s: 16}"));

}  // namespace
}  // namespace upright
