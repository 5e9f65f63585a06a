// What mutants of input files found, each as a case of its own.
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "commissioning/file_agreement.hpp"
#include "experiment/experiment.hpp"
#include "mutant_feeder.hpp"
#include "report/plot.hpp"
#include "sweep/sweep.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/calibration.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;

Plant good_plant() {
  return read_plant_file(config / "plants" / "exponential.yaml");
}

/// Steps shrank to nothing, and the simulation never ended.
TEST(MutantFinds, AMotorLagOfNearlyNothingIsSimulated) {
  Plant plant = good_plant();
  plant.set("motor_lag", {5e-324});
  Simulator<double> simulator(make_model<double>(plant));
  simulator.start({});
  simulator.command(0.0, 2.0);
  simulator.advance_to(0.05);
  EXPECT_GT(simulator.engine().state().cart_m, 1e-4);
  EXPECT_LT(simulator.engine().step_count(), 1000u);
}

/// The roots of 2000 states took minutes, those of 200,000 had no room in memory.
TEST(MutantFinds, APredictorOverTooManyPeriodsIsRefused) {
  ControlConfig control = read_gain_file(config / "gains" / "compensated.yaml");
  control.sample_rate_hz = 20000.0;
  control.delay_s = 10.0;
  const Agreement agreement = agreement_of({std::nullopt, control, good_plant()});
  ASSERT_EQ(agreement.errors.size(), 1u);
  EXPECT_NE(
      agreement.errors[0].find("too long to compute the roots of the loop: lower sample_rate_hz or delay_s"),
      std::string::npos)
      << agreement.errors[0];
}

ExperimentSetup setup_of(const std::string& travel_m, const std::string& piece, const Folder& folder) {
  const fs::path file = folder.path() / "experiments" / "test.yaml";
  write(file, "experiment:\n  name: test\n  why: a test\n  travel_m: " + travel_m +
                  "\n  voltage_limit_v: 10\n  pieces:\n    - " + piece + "\n");
  return resolve_experiment(file, config / "rigs" / "simulated.yaml", "", std::nullopt);
}

void expect_refusal(const std::function<void()>& what, const std::string& place, const std::string& words) {
  try {
    what();
    ADD_FAILURE() << "nothing was refused";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find(place), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

/// Its rehearsal would have taken hours: ten million steps for a second.
TEST(MutantFinds, AnExperimentOnAPlantThatIsFarTooStiffIsRefused) {
  const Folder folder;
  ExperimentSetup setup = setup_of("0.3", "{kind: observe, duration_s: 60}", folder);
  setup.plant.motor.back_emf_n_per_mps = 1e9;
  expect_refusal([&] { rehearse_all(setup); }, "test.yaml:7: ", "are too long to rehearse");
}

TEST(MutantFinds, ATravelBeyondTheTrackIsRefusedAtItsLine) {
  const Folder folder;
  expect_refusal([&] { setup_of("1", "{kind: observe, duration_s: 1}", folder); },
                 "test.yaml:4: ", "the rig stops at 0.4 m");
}

/// Runs of other cases made the search for transitions read beyond the end of the list.
TEST(MutantFinds, ASweepMakesAnewWhatItsJournalKeepsOfOtherCases) {
  const Folder folder;
  const fs::path file = folder.path() / "sweeps" / "short.yaml", out = folder.path() / "out";
  write(
      file,
      "sweep:\n  plant: ../plants/exponential.yaml\n  gains: ../gains/exponential.yaml\n  loop: continuous\n"
      "  theta0_deg: [1.0, 2.0]\n  delay_s: [0.0, 0.01, 0.02, 0.04]\n  duration_s: 0.5\n"
      "  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n  engine: fast\n");
  const SweepConfig sweep = read_sweep_file(file);
  const auto executor = make_thread_executor(sweep, 1);
  std::string journal;
  SweepOptions options;
  options.progress = [&](std::size_t, std::size_t) { journal = text_of(out / "sweep.partial"); };
  run_sweep(sweep, out, options, *executor);
  const std::string expected = text_of(out / "sweep.csv"), moved = text_of(out / "transitions.csv");

  for (std::size_t at = 0; (at = journal.find(" 0.04 ", at)) != std::string::npos;)
    journal.replace(at, 6, " 0.02 ");
  fs::remove_all(out);
  fs::create_directory(out);
  write(out / "sweep.partial", journal);
  run_sweep(sweep, out, {}, *executor);
  EXPECT_EQ(text_of(out / "sweep.csv"), expected);
  EXPECT_EQ(text_of(out / "transitions.csv"), moved);
}

/// The difference of two counts left the range of a signed number.
TEST(MutantFinds, CountsAtTheEndsOfTheirRangeAreFollowed) {
  constexpr std::int64_t largest = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(counts_between(largest, -10, 32), -9) << "the lowest 32 bits of the largest number are all ones";
  Unwrapper unwrapper;
  unwrapper.start(-10, largest);
  EXPECT_EQ(unwrapper.follow(largest), 0);
}

/// The edge of the outermost cell was zero, and the search for ticks went through all powers of ten to it.
TEST(MutantFinds, AMapOverTooManyPowersOfTenIsDrawn) {
  Plot plot;
  plot.x.logarithmic = plot.y.logarithmic = true;
  plot.heat_map = HeatMap{{1e-3, 1e-2}, {1e-300, 0.03}, {0, 1, 1, 2}, "", {"stable", "oscillating", "fell"}};
  EXPECT_NE(svg_of(plot, "p").find("<svg"), std::string::npos);
}

}  // namespace
}  // namespace upright::testing
