// An identification is a function of the set of runs: in whatever order they are read, the same numbers come
// out, bit for bit, and each reading names the run it is from.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "experiment/experiment.hpp"
#include "identification/identification.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

const std::filesystem::path config = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config";

Measurement measurement_of(const std::string& name, const std::vector<LogRecord>& rows) {
  Measurement m;
  m.name = name;
  for (const LogRecord& row : rows) {
    m.time_s.push_back(static_cast<double>(row.time_ns) * 1e-9);
    m.voltage_v.push_back(row.voltage_v);
    m.cart_m.push_back(row.cart_m);
    m.theta_rad.push_back(row.theta_rad);
  }
  m.cart_resolution_m = find_resolution(m.cart_m);
  m.theta_resolution_rad = find_resolution(m.theta_rad);
  return m;
}

/// Runs without dry friction, each from its second second on: the cart never rests, so that the search for
/// what happens between rest and sliding, which takes long, is left out.
std::vector<Measurement> short_runs() {
  ExperimentSetup setup;
  const std::string piece =
      "    - {kind: multisine, lowest_hz: 0.5, highest_hz: 6, lines: 8, fit_to_travel: true, ";
  setup.experiment = read_experiment_text(
      "experiment:\n  name: short\n  why: a test\n  travel_m: 0.3\n  voltage_limit_v: 10\n  pieces:\n" +
          piece + "amplitude_v: 4, duration_s: 5}\n" + piece + "amplitude_v: 3, duration_s: 4}\n" + piece +
          "amplitude_v: 2, duration_s: 6}\n",
      config / "experiments" / "short.yaml");
  setup.rig = read_rig_file(config / "rigs" / "simulated.yaml");
  setup.rig.amplifier.limit_v = 10.0;
  setup.plant = read_plant_file(config / "plants" / "viscous.yaml");
  setup.control.sample_rate_hz = 250.0;
  std::vector<Measurement> runs;
  for (const Piece& planned : plan_pieces(setup)) {
    const std::vector<LogRecord> rows = rehearse(planned, setup).rows;
    runs.push_back(measurement_of(planned.label, {rows.begin() + 250, rows.begin() + 900}));
  }
  return runs;
}

TEST(Identification, DoesNotDependOnTheOrderOfTheRuns) {
  const Plant base = read_plant_file(config / "plants" / "viscous.yaml");
  std::vector<Measurement> runs = short_runs();
  const Identification first = identify(base, runs);
  ASSERT_FALSE(first.parameters.empty());
  std::rotate(runs.begin(), runs.begin() + 1, runs.end());
  const Identification again = identify(base, runs);
  ASSERT_EQ(again.parameters.size(), first.parameters.size());
  for (std::size_t p = 0; p < first.parameters.size(); ++p) {
    EXPECT_EQ(again.parameters[p].name, first.parameters[p].name);
    EXPECT_EQ(again.parameters[p].value, first.parameters[p].value) << first.parameters[p].name;
    EXPECT_EQ(again.parameters[p].low, first.parameters[p].low) << first.parameters[p].name;
  }
}

}  // namespace
}  // namespace upright
