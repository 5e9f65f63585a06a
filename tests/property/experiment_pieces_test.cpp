// Every kind of piece with every field at its limits and beyond: it is planned, or refused with file and
// line. What is planned can be run to its end.
#include <gtest/gtest.h>

#include <cstdio>
#include <ctime>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "experiment/experiment.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

const std::filesystem::path config = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config";

using Fields = std::vector<std::pair<std::string, std::string>>;

struct Kind {
  const char* name;
  Fields fields;
};

const std::vector<Kind> kinds = {
    {"constant_voltage", {{"voltages_v", "[2.0]"}, {"repeats", "1"}, {"fit_to_travel", "true"}}},
    {"ramp", {{"rate_v_per_s", "0.5"}, {"largest_v", "2"}, {"repeats", "1"}}},
    {"coast", {{"voltages_v", "[2.0]"}, {"push_s", "0.3"}, {"repeats", "1"}, {"fit_to_travel", "true"}}},
    {"square_wave",
     {{"amplitude_v", "2"}, {"period_s", "0.8"}, {"duration_s", "2"}, {"fit_to_travel", "true"}}},
    {"multisine",
     {{"amplitude_v", "2"},
      {"lowest_hz", "0.5"},
      {"highest_hz", "5"},
      {"lines", "8"},
      {"duration_s", "2"},
      {"fit_to_travel", "true"}}},
    {"slow_sine", {{"amplitude_m", "0.1"}, {"period_s", "4"}, {"duration_s", "4"}}},
    {"free_decay", {{"angle_deg", "30"}, {"duration_s", "1"}, {"patience_s", "60"}}},
    {"observe", {{"duration_s", "1"}, {"simulated_push_mps", "0.1"}}},
    {"closed_loop",
     {{"set_points_m", "[0, 0.05]"},
      {"hold_s", "1"},
      {"delay_s", "0"},
      {"gains", "{a: ../gains/exponential.yaml, b: ../gains/viscous.yaml}"},
      {"repeats", "1"},
      {"start", "hand"},
      {"theta0_deg", "1"},
      {"patience_s", "60"}}},
    {"delay_sweep",
     {{"delay_s", "[0, 0.01]"},
      {"duration_s", "1"},
      {"repeats", "1"},
      {"bisect_to_s", "0.001"},
      {"stable_below_rad", "0.006"},
      {"start", "swing_up"},
      {"theta0_deg", "1"},
      {"patience_s", "60"}}},
    {"sign_check", {{"largest_v", "4"}, {"patience_s", "60"}}},
};

/// The ends of every range that a field has, what is just beyond them, and what no field means.
const std::vector<std::string> ends = {
    "0",    "-1", "5e-324", "1e-9", "0.001", "0.01",  "0.5",  "1",    "5",  "8",   "64", "100", "170", "300",
    "1000", "10", "3600",   "3601", "1e9",   "1e300", ".nan", ".inf", "[]", "[0]", "~",  "x",   "{}"};

std::string text_of(const Kind& kind, const std::string& field, const std::string& value) {
  std::string text = std::string("{kind: ") + kind.name;
  for (const auto& [name, usual] : kind.fields) text += ", " + name + ": " + (name == field ? value : usual);
  return text + "}";
}

ExperimentSetup setup_with(const std::string& piece) {
  ExperimentSetup setup;
  setup.experiment = read_experiment_text(
      "experiment:\n  name: test\n  why: a test\n  gains: ../gains/exponential.yaml\n  travel_m: 0.3\n"
      "  voltage_limit_v: 100\n  pieces:\n    - " +
          piece + "\n",
      config / "experiments" / "test.yaml");
  setup.rig = read_rig_file(config / "rigs" / "simulated.yaml");
  setup.rig.amplifier.limit_v = 100.0;
  setup.plant = read_plant_file(config / "plants" / "exponential.yaml");
  setup.control = read_gain_file(config / "gains" / "exponential.yaml");
  // Less computing; what balances needs the more.
  setup.control.sample_rate_hz = balances(setup.experiment.pieces.front()) ? 100.0 : 20.0;
  read_controllers(setup, setup.control.sample_rate_hz);
  return setup;
}

enum class Fate { refused_by_reader, refused_by_plan, planned };

Fate fate_of(const std::string& piece) {
  const auto expect_place = [&](const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("test.yaml:8: "), std::string::npos) << piece << "\n"
                                                                                  << error.what();
  };
  ExperimentSetup setup;
  try {
    setup = setup_with(piece);
  } catch (const ConfigError& error) {
    expect_place(error);
    return Fate::refused_by_reader;
  }
  try {
    const std::vector<PlannedPiece> plan = rehearse_all(setup);
    EXPECT_EQ(plan.size(), 1u);
    return Fate::planned;
  } catch (const ConfigError& error) {
    expect_place(error);
    return Fate::refused_by_plan;
  }
}

double processor_time_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

class Pieces : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Pieces, AtEveryLimitArePlannedOrRefusedWithTheirPlace) {
  constexpr double longest_s = 10.0;
  const Kind& kind = kinds[GetParam()];
  int fates[3] = {0, 0, 0};
  double slowest_s = 0.0;
  for (const auto& [field, usual] : kind.fields)
    for (const std::string& value : ends)
      for (const std::string& text : {value, "[" + value + "]", "[0, " + value + "]"}) {
        const double begun_s = processor_time_s();
        ++fates[static_cast<int>(fate_of(text_of(kind, field, text)))];
        const double took_s = processor_time_s() - begun_s;
        slowest_s = std::max(slowest_s, took_s);
        EXPECT_LT(took_s, longest_s) << text_of(kind, field, text);
      }
  std::printf("%-16s %4d refused by the reader, %4d by the plan, %4d planned, slowest %.2f s\n", kind.name,
              fates[0], fates[1], fates[2], slowest_s);
  EXPECT_GT(fates[2], 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Pieces, ::testing::Range(std::size_t{0}, kinds.size()),
                         [](const auto& test) { return std::string(kinds[test.param].name); });

}  // namespace
}  // namespace upright
