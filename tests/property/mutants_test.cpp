// Mutants of every kind of configuration file, given to what reads it and to what uses it next: each is read
// or refused with an Error that names the file and the line, within a bounded time. Meant for the address
// sanitizer (.ci/run runs it there); the number of mutants of each kind is UPRIGHT_MUTANTS, the first seed
// UPRIGHT_MUTANT_SEED (1).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "commissioning/file_agreement.hpp"
#include "control/filter_model.hpp"
#include "experiment/experiment.hpp"
#include "mutant_feeder.hpp"
#include "short_experiments.hpp"
#include "sweep/sweep.hpp"
#include "upright/base/error.hpp"
#include "upright/control/controller.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/session.hpp"
#include "upright/sim/simulator.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;

RigFile good_rig() {
  return read_rig_file(config / "rigs" / "simulated.yaml");
}

ControlConfig good_gains() {
  return read_gain_file(config / "gains" / "exponential.yaml");
}

Plant good_plant() {
  return read_plant_file(config / "plants" / "exponential.yaml");
}

/// The repository's plants, and one with each effect that there is.
std::vector<std::string> plants() {
  std::vector<std::string> texts = own_texts("plants");
  for (std::size_t i = 0; i < effect_registry().size(); ++i) {
    const EffectInfo& info = effect_registry()[i];
    std::array<double, max_effect_parameters> values{};
    for (std::size_t k = 0; k < info.parameters.size(); ++k) values[k] = info.parameters[k].typical;
    Plant plant = good_plant();
    plant.set(i, values);
    texts.push_back(plant_text(plant));
  }
  return texts;
}

/// Follows a plant over 50 periods of 5 ms.
void simulate(const Plant& plant) {
  Simulator<double> simulator(make_model<double>(plant));
  PlantState<double> state;
  state.theta_rad = 0.05;
  simulator.start(state);
  for (int i = 0; i < 50; ++i) {
    simulator.command(0.005 * i, i % 10 < 5 ? 2.0 : -2.0);
    simulator.advance_to(0.005 * (i + 1));
  }
}

TEST(Mutants, OfPlants) {
  const Folder folder;
  const RigFile rig = good_rig();
  const ControlConfig control = good_gains();
  feed({"plant", plants(), "plants/plant-mutant.yaml", longest_motion_s}, folder, mutants(),
       [&](const fs::path& file) {
         const Plant plant = read_plant_file(file);
         const std::string once = plant_text(plant);
         EXPECT_EQ(plant_text(read_plant(YamlMap::from_text(once, "again"))), once) << current_mutant();
         doubts_about(plant);
         agreement_of({rig, control, plant});
         rig_limits(rig, plant);
         simulate(plant);
       });
}

/// 200 periods of a loop on a sine, some of them without a sample.
void drive(const ControlConfig& control) {
  Controller controller(control, 10.0, make_model_parts(control));
  std::uint64_t tick = 0;
  for (int i = 0; i < 200; ++i) {
    const double t_s = control.period_s() * static_cast<double>(tick += i % 20 == 0 ? 3 : 1);
    controller.step({tick, 0.05 * std::sin(5.0 * t_s), 0.1 * std::cos(3.0 * t_s), 0.0});
  }
}

TEST(Mutants, OfGains) {
  const Folder folder;
  const RigFile rig = good_rig();
  const Plant plant = good_plant();
  feed({"gains", own_texts("gains"), "gains/gains-mutant.yaml", longest_motion_s}, folder, mutants(),
       [&](const fs::path& file) {
         const ControlConfig control = read_gain_file(file);
         const std::string once = gain_text(control);
         EXPECT_EQ(gain_text(read_gains(YamlMap::from_text(once, "again"))), once) << current_mutant();
         doubts_about(control);
         agreement_of({rig, control, plant});
         // What cannot be run says so, and what is said of a model is said of the file.
         try {
           drive(with_encoders(control, rig.calibration.cart.per_count, rig.calibration.pendulum.per_count));
         } catch (const ConfigError& error) {
           throw ConfigError(file.string() + ":1: " + error.what());
         }
       });
}

TEST(Mutants, OfRigs) {
  const Folder folder;
  const ControlConfig control = good_gains();
  const Plant plant = good_plant();
  std::vector<std::string> texts = own_texts("rigs");
  texts.push_back(texts.back() +
                  "encoder_watch: {breakaway_v: {from: 0.3, to: 1.2}, largest_lag_s: 0.01, "
                  "acceleration_mps2_per_v: 1.5, damping_v_per_mps: 9.5, unseen_travel_m: 1e-4, "
                  "longest_pendulum_m: 0.7, pivot_friction_mps2: 0.1}\n");
  feed({"rig", texts, "rigs/rig-mutant.yaml"}, folder, mutants(), [&](const fs::path& file) {
    const RigFile rig = read_rig_file(file);
    const std::string once = rig_text(rig);
    EXPECT_EQ(rig_text(read_rig(YamlMap::from_text(once, "again"))), once) << current_mutant();
    doubts_about(rig);
    agreement_of({rig, control, plant});
    rig_limits(rig, plant);
    PoseScaler scaler(calibration_in_use(rig));
    for (const std::int64_t counts :
         {std::int64_t{0}, std::int64_t{70000}, std::int64_t{-2000000000}, std::int64_t{2147483647}})
      scaler.scale(counts, -counts);
    if (!rig.simulated || !is_simulated(rig)) return;
    VirtualClock clock;
    const auto simulated = make_simulated_rig(rig, plant, clock, {});
    simulated->open();
    for (int i = 0; i < 50; ++i) {
      simulated->read();
      simulated->write(1.0);
      clock.sleep_until(clock.now_ns() + 1'000'000);
    }
    simulated->stop();
  });
}

TEST(Mutants, OfSweeps) {
  const Folder folder;
  feed({"sweep", own_texts("sweeps"), "sweeps/mutant.yaml", longest_motion_s}, folder, mutants(),
       [](const fs::path& file) {
         SweepConfig sweep = read_sweep_file(file);
         linear_margins(sweep);
         sweep.setup.duration_s = std::min(sweep.setup.duration_s, 0.2);
         run_sweep_group(sweep, {{sweep.theta0_rad.front(), sweep.delay_s.back()}});
       });
}

/// States that no rig has, and some that one has.
ControlState any_state(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double wild = random() % 50 == 0 ? 1e6 : 1.0;
  return {0.2 * wild * normal(random), std::numbers::pi + normal(random) * wild, normal(random),
          3.0 * normal(random)};
}

/// Runs the script of each piece through states of every kind; its demands need not be sensible.
void drive_scripts(const ExperimentSetup& setup) {
  for (const Piece& piece : setup.experiment.pieces) {
    const std::string once = piece_text(piece);
    EXPECT_EQ(piece_text(read_piece(YamlMap::from_text("piece: " + once, "again").map("piece"))), once)
        << current_mutant();
    ExperimentScript script(piece, {setup.control.period_s(), setup.experiment.travel_m, 10.0,
                                    servo_model(setup.plant), setup.control.gains});
    std::mt19937_64 random(7);
    ControlState state{0.0, std::numbers::pi, 0.0, 0.0};
    std::uint64_t tick = 0;
    for (int i = 0; i < 1500; ++i) {
      if (i % 300 == 200) state = any_state(random);
      if (i % 300 == 0) state = {0.0, std::numbers::pi, 0.0, 0.0};
      const Demand demand = script.next(tick += 1 + random() % 3, state);
      if (demand.over || demand.timed_out) break;
    }
  }
}

ExperimentSetup setup_of(const fs::path& file) {
  return resolve_experiment(file, config / "rigs" / "simulated.yaml", "", std::nullopt);
}

TEST(Mutants, OfExperiments) {
  const Folder folder;
  std::vector<std::string> texts = own_texts("experiments");
  const std::vector<std::string> brief = short_experiments();
  texts.insert(texts.end(), brief.begin(), brief.end());
  feed({"experiment", texts, "experiments/mutant.yaml"}, folder, mutants(),
       [](const fs::path& file) { drive_scripts(setup_of(file)); });
}

TEST(Mutants, OfExperimentsArePlanned) {
  const Folder folder;
  feed({"plan", short_experiments(), "experiments/mutant.yaml", longest_plan_s}, folder, mutants(),
       [](const fs::path& file) { rehearse_all(setup_of(file)); });
}

/// Experiments on a plant that is a mutant itself, however stiff: what a rehearsal costs is bounded too.
TEST(Mutants, OfPlantsAreRehearsed) {
  const Folder folder;
  const fs::path experiment = folder.path() / "experiments" / "short.yaml";
  write(experiment, short_experiments()[3]);
  feed({"rehearsal", plants(), "plants/plant-mutant.yaml", longest_plan_s}, folder, mutants() / 4 + 1,
       [&](const fs::path& file) {
         rehearse_all(resolve_experiment(experiment, config / "rigs" / "simulated.yaml", file, std::nullopt));
       });
}

}  // namespace
}  // namespace upright::testing
