// Mistakes of sign, zero, unit and order in measured data are named before any search, with lines that undo
// them; effects that a rig may have are no mistakes.
#include "measurement/data_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "blind_case.hpp"
#include "effect_sizes.hpp"
#include "measurement/dataset_file.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/model/effect.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;
using blind::Experiment;

constexpr double degree = std::numbers::pi / 180.0;

Plant paper_plant() {
  Plant plant;
  plant.cart_mass_kg = 0.815;
  plant.pendulum = Pendulum{0.210, 0.305, {}};
  plant.motor = {1.7189, 7.682};
  plant.set("viscous_friction", {3.0});
  return plant;
}

/// Another machine: heavy, geared, slow.
Plant heavy_plant() {
  Plant plant;
  plant.cart_mass_kg = 6.3;
  plant.pendulum = Pendulum{0.45, 0.42, {}};
  plant.motor = {9.0, 25.0};
  plant.set("viscous_friction", {8.0});
  return plant;
}

Measurement record(const Plant& plant, Experiment experiment, double friction_n) {
  blind::Rig rig;
  rig.plant = plant;
  rig.plant.set("coulomb_friction", {friction_n});
  blind::Plan plan;
  plan.experiment = experiment;
  plan.rate_hz = 500.0;
  plan.duration_s = 8.0;
  plan.amplitude_v = 4.0;
  plan.swing_rad = experiment == Experiment::balance        ? 0.05
                   : experiment == Experiment::locked_swing ? 0.8
                                                            : 0.2;
  plan.gains = {70.7107, 304.9273, 143.3152, 61.0833};
  return blind::measure(rig, plan, "record");
}

/// A mistake in how a file is described, put on top of a record that has none.
struct Mistake {
  const char* name;
  const char* said;  ///< a part of what is said of it
  double time = 1.0, voltage = 1.0, cart = 1.0, theta = 1.0;
  bool hanging = false;
};

constexpr Mistake mistakes[] = {
    {"voltage_sign", "voltage_v has the wrong sign", 1.0, -1.0},
    {"cart_sign", "cart_m has the wrong sign", 1.0, 1.0, -1.0},
    {"angle_sign", "theta_rad has the wrong sign", 1.0, 1.0, 1.0, -1.0},
    {"angle_zero", "theta_rad is zero where the pendulum hangs", 1.0, 1.0, 1.0, 1.0, true},
    {"degrees", "theta_rad is in degrees", 1.0, 1.0, 1.0, 1.0 / degree},
    {"degrees_hanging", "degrees", 1.0, 1.0, 1.0, 1.0 / degree, true},
    {"millimetres", "cart_m is in millimetres", 1.0, 1.0, 1000.0},
    {"centimetres", "cart_m is in centimetres", 1.0, 1.0, 100.0},
    {"milliseconds", "time_s is in milliseconds", 1000.0},
    {"millivolts", "voltage_v is in millivolts", 1.0, 1000.0},
    {"millimetres_and_degrees", "millimetres", 1.0, 1.0, 1000.0, 1.0 / degree},
};

class DataCheck : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("upright_check_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write_csv(const Measurement& m, const Mistake& mistake) const {
    std::ofstream csv(folder_ / "record.csv");
    csv << "t,u" << (m.has_cart() ? ",x" : "") << ",th\n";
    for (std::size_t k = 0; k < m.size(); ++k) {
      csv << exact_text(m.time_s[k] * mistake.time) << ',' << exact_text(m.voltage_v[k] * mistake.voltage);
      if (m.has_cart()) csv << ',' << exact_text(m.cart_m[k] * mistake.cart);
      const double theta = m.theta_rad[k] - (mistake.hanging ? std::numbers::pi : 0.0);
      csv << ',' << exact_text(theta * mistake.theta) << '\n';
    }
  }

  /// The dataset file with these lines in place of the plain ones.
  fs::path dataset(const Measurement& m, const std::vector<std::string>& lines = {}) const {
    std::vector<std::string> columns = {"time_s: t", "voltage_v: u", "theta_rad: th"};
    if (m.has_cart()) columns.emplace_back("cart_m: x");
    for (const std::string& line : lines)
      for (std::string& column : columns)
        if (column.substr(0, column.find(':')) == line.substr(0, line.find(':'))) column = line;
    std::ofstream file(folder_ / "record.yaml");
    file << "dataset:\n  file: record.csv\n  cart_locked: " << (m.cart_locked ? "true" : "false")
         << "\n  columns:\n";
    for (const std::string& column : columns) file << "    " << column << "\n";
    return folder_ / "record.yaml";
  }

  fs::path folder_;
};

/// The property: the lines that are said, put into the dataset file, make the data pass; and the mistake that
/// was made is the one that is said.
TEST_F(DataCheck, NamesEachMistakeWithLinesThatUndoIt) {
  for (const Plant& plant : {paper_plant(), heavy_plant()})
    for (const Experiment experiment : {Experiment::multisine, Experiment::square, Experiment::constant}) {
      const Measurement m = record(plant, experiment, 0.02 * plant.motor.force_per_volt_n * 10.0);
      for (const Mistake& mistake : mistakes) {
        SCOPED_TRACE(std::string(name_of(experiment)) + " " + mistake.name);
        write_csv(m, mistake);
        const auto found = find_mistakes({read_measurement(dataset(m))}, plant);
        ASSERT_EQ(found.size(), 1u);
        std::string said = found[0].cause;
        for (const std::string& other : found[0].or_else) said += " or " + other;
        EXPECT_NE(said.find(mistake.said), std::string::npos) << said;
        ASSERT_FALSE(found[0].lines.empty());
        const auto again = find_mistakes({read_measurement(dataset(m, found[0].lines))}, plant);
        EXPECT_TRUE(again.empty()) << again[0].cause << " after " << found[0].lines[0];
      }
    }
}

TEST_F(DataCheck, KnowsTheZeroAndUnitOfAFreeDecay) {
  const Measurement m = record(paper_plant(), Experiment::locked_swing, 0.3);
  for (const Mistake& mistake : mistakes) {
    const bool of_angle = mistake.hanging || std::abs(mistake.theta) > 1.0;
    if (mistake.cart != 1.0 || !(of_angle || mistake.time != 1.0)) continue;
    SCOPED_TRACE(mistake.name);
    write_csv(m, mistake);
    const auto found = find_mistakes({read_measurement(dataset(m))}, paper_plant());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NE(found[0].cause.find(mistake.said), std::string::npos) << found[0].cause;
    EXPECT_TRUE(find_mistakes({read_measurement(dataset(m, found[0].lines))}, paper_plant()).empty());
  }
}

TEST_F(DataCheck, KnowsSignsAndUnitsInAClosedLoop) {
  const Measurement m = record(paper_plant(), Experiment::balance, 0.43);
  for (const Mistake& mistake : mistakes) {
    SCOPED_TRACE(mistake.name);
    write_csv(m, mistake);
    const auto found = find_mistakes({read_measurement(dataset(m))}, paper_plant());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_TRUE(find_mistakes({read_measurement(dataset(m, found[0].lines))}, paper_plant()).empty());
  }
}

TEST_F(DataCheck, KnowsSwappedColumns) {
  const Plant plant = paper_plant();
  const Measurement m = record(plant, Experiment::multisine, 0.4);
  write_csv(m, {"none", ""});
  for (const auto& [a, b] : {std::pair{"voltage_v: x", "cart_m: u"}, std::pair{"theta_rad: x", "cart_m: th"},
                             std::pair{"voltage_v: th", "theta_rad: u"}}) {
    SCOPED_TRACE(a);
    const auto found = find_mistakes({read_measurement(dataset(m, {a, b}))}, plant);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NE(found[0].cause.find("swapped"), std::string::npos) << found[0].cause;
    EXPECT_TRUE(find_mistakes({read_measurement(dataset(m, found[0].lines))}, plant).empty());
  }
}

/// Values as they were `later_s` before.
std::vector<double> late(const Measurement& m, const std::vector<double>& values, double later_s) {
  std::vector<double> result;
  for (const double t : m.time_s) {
    const auto at = std::upper_bound(m.time_s.begin(), m.time_s.end(), t - later_s + 1e-9);
    result.push_back(
        values[at == m.time_s.begin() ? 0 : static_cast<std::size_t>(at - m.time_s.begin()) - 1]);
  }
  return result;
}

struct LateColumn {
  const char* name;
  std::vector<double> Measurement::*values;
  const char* said;
  const char* line;
};

TEST_F(DataCheck, NamesAColumnThatIsLaterThanOthersWithItsTime) {
  const LateColumn columns[] = {
      {"angle", &Measurement::theta_rad, "theta_rad is", "theta_rad: {column: th, delay_s: 0.0"},
      {"cart", &Measurement::cart_m, "cart_m is", "cart_m: {column: x, delay_s: 0.0"},
      {"voltage", &Measurement::voltage_v, "voltage_v is", "voltage_v: {column: u, delay_s: 0.0"}};
  for (const Plant& plant : {paper_plant(), heavy_plant()})
    for (const LateColumn& column : columns)
      for (const double later_s : {0.02, 0.05}) {
        SCOPED_TRACE(column.name);
        const Measurement m = record(plant, Experiment::multisine, 0.4);
        Measurement moved = m;
        moved.*column.values = late(m, m.*column.values, later_s);
        write_csv(moved, {"none", ""});
        const auto found = find_mistakes({read_measurement(dataset(m))}, plant);
        ASSERT_EQ(found.size(), 1u);
        EXPECT_EQ(found[0].cause.find(column.said), 0u) << found[0].cause;
        ASSERT_EQ(found[0].lines.size(), 1u);
        EXPECT_EQ(found[0].lines[0].find(column.line), 0u) << found[0].lines[0];
        const std::string said_s = found[0].lines[0].substr(found[0].lines[0].rfind(' '));
        EXPECT_NEAR(std::stod(said_s), later_s, 0.003);
        EXPECT_TRUE(find_mistakes({read_measurement(dataset(m, found[0].lines))}, plant).empty());
      }
}

/// Motions that come after the voltage are what a delay or a lag of the rig does.
TEST_F(DataCheck, TakesMotionsThatAreBothLateForTheRigsOwnDelay) {
  for (const double later_s : {0.005, 0.02, 0.05}) {
    Measurement m = record(paper_plant(), Experiment::multisine, 0.4);
    m.cart_m = late(m, m.cart_m, later_s);
    m.theta_rad = late(m, m.theta_rad, later_s);
    write_csv(m, {"none", ""});
    const auto found = find_mistakes({read_measurement(dataset(m))}, paper_plant());
    EXPECT_TRUE(found.empty()) << found[0].cause;
  }
}

TEST_F(DataCheck, NamesStampsThatScatterAboutTheClockOfTheRows) {
  Measurement m = record(paper_plant(), Experiment::multisine, 0.4);
  std::uint32_t random = 1;
  for (std::size_t k = 1; k < m.size(); ++k) {
    random = random * 1664525u + 1013904223u;
    m.time_s[k] += 0.0008 * (static_cast<double>(random >> 8) / 16777216.0 - 0.5);
  }
  write_csv(m, {"none", ""});
  const auto found = find_mistakes({read_measurement(dataset(m))}, paper_plant());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].cause.find("time_s scatters"), std::string::npos) << found[0].cause;
  EXPECT_EQ(found[0].lines, std::vector<std::string>{"time_s: {column: t, period_s: 0.002}"});
  EXPECT_TRUE(find_mistakes({read_measurement(dataset(m, found[0].lines))}, paper_plant()).empty());
}

/// Where the rows themselves come unsteadily and their stamps say so, nothing is wrong.
TEST_F(DataCheck, IsSilentAboutRowsThatComeUnsteadily) {
  blind::Rig rig;
  rig.plant = paper_plant();
  rig.plant.set("coulomb_friction", {0.4});
  rig.jitter_s = 0.0004;
  rig.actual_times = true;
  blind::Plan plan;
  plan.experiment = Experiment::multisine;
  plan.rate_hz = 500.0;
  plan.duration_s = 8.0;
  plan.amplitude_v = 4.0;
  const auto found = find_mistakes({blind::measure(rig, plan, "unsteady")}, rig.plant);
  EXPECT_TRUE(found.empty()) << found[0].cause;
}

/// The pendulum turns over: an angle within a part of a turn jumps, or is mirrored.
TEST_F(DataCheck, NamesFoldedAndMirroredAngles) {
  using std::numbers::pi;
  const Plant plant = paper_plant();
  blind::Rig rig;
  rig.plant = plant;
  blind::Plan plan;
  plan.experiment = Experiment::locked_swing;
  plan.rate_hz = 500.0;
  plan.duration_s = 8.0;
  plan.swing_rad = 2.6;
  const Measurement m = blind::measure(rig, plan, "swing");
  const auto folded = [](double from, double width) {
    return [from, width](double a) { return a - width * std::floor((a - from) / width); };
  };
  const std::pair<const char*, std::function<double(double)>> cases[] = {
      {"folded", folded(-0.5 * pi, pi)},
      {"folded", folded(0.0, 0.5 * pi)},
      {"mirrored", [](double a) { return std::asin(std::sin(a)); }},
      {"mirrored", [](double a) { return std::acos(std::cos(a)); }},
      {"degrees", [&](double a) { return folded(-180.0, 360.0)(a / degree); }},
      {"folded", [&](double a) { return folded(0.0, 90.0)(a / degree); }},
  };
  int number = 0;
  for (const auto& [said, fold] : cases) {
    SCOPED_TRACE(number++);
    Measurement seen = m;
    for (double& a : seen.theta_rad) a = fold(a);
    write_csv(seen, {"none", ""});
    const auto found = find_mistakes({read_measurement(dataset(m))}, plant);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NE(found[0].cause.find(said), std::string::npos) << found[0].cause;
    ASSERT_FALSE(found[0].lines.empty());
    const auto again = find_mistakes({read_measurement(dataset(m, found[0].lines))}, plant);
    EXPECT_TRUE(again.empty()) << again[0].cause << " after " << found[0].lines[0];
  }
}

/// A rig that differs from its plant file is no mistake in its data, whatever it differs by.
TEST_F(DataCheck, IsSilentAboutEveryEffectThatACaseHides) {
  std::uint64_t seed = 42;
  for (const std::string& kind : blind::hidden_kinds()) {
    blind::Request request;
    request.hidden = {kind};
    request.size = blind::Size::strong;
    request.seed = ++seed;
    request.runs = 2;
    request.duration_s = 5.0;
    request.max_samples = 3000.0;
    request.condition = seed % 2 == 0 ? blind::Condition::disturbed : blind::Condition::quantized;
    const blind::Case hidden = blind::make_case(request);
    const auto found = find_mistakes(blind::measure_all(hidden), hidden.believed);
    EXPECT_TRUE(found.empty()) << kind << ": " << found[0].cause;
  }
}

/// The voltage of a closed loop follows the motion, so a later one accounts for it too. The motor of this rig
/// is 31 ms late, and its cart has a strong drag.
TEST_F(DataCheck, IsSilentAboutALateMotorInAClosedLoop) {
  blind::Request request =
      blind::laboratory_request(blind::seed_of_case(20261220, 5), {"quadratic_drag", "input_delay"});
  request.size = blind::Size::strong;
  request.runs = 7;
  request.rate_hz = 1000.0;
  request.duration_s = 10.0;
  request.max_samples = 70000.0;
  const blind::Case hidden = blind::make_case(request);
  const auto found = find_mistakes(blind::measure_all(hidden), hidden.believed);
  EXPECT_TRUE(found.empty()) << found[0].cause;
}

TEST_F(DataCheck, RefusesMotionThatNoVoltageOfTheRecordMakes) {
  const Plant plant = paper_plant();
  Measurement m = record(plant, Experiment::multisine, 0.4);
  // No unit: the cart's position mixed with noise a hundred times as large as it could be.
  for (std::size_t k = 0; k < m.size(); ++k) m.cart_m[k] = 30.0 * std::sin(2.0 * m.time_s[k]);
  m.known_cart_noise_m.reset();
  EXPECT_THROW(refuse_mistakes({m}, plant), ConfigError);
}

/// Another run's voltage: no mistake undone explains it, and a search would end in a saturation at 0 V.
TEST_F(DataCheck, RefusesAVoltageThatDoesNotMoveTheCart) {
  const Plant plant = paper_plant();
  Measurement m = record(plant, Experiment::multisine, 0.4);
  std::uint32_t random = 1;
  for (double& v : m.voltage_v) {
    random = random * 1664525u + 1013904223u;
    v = 8.0 * (static_cast<double>(random >> 8) / 16777216.0 - 0.5);
  }
  const auto found = find_mistakes({m}, plant);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].cause.find("of the recorded voltage"), std::string::npos) << found[0].cause;
}

/// Travel that is steady needs no voltage, and is none of a rig all the same.
TEST_F(DataCheck, RefusesTravelAndSpeedsThatNoRigHas) {
  const Plant plant = paper_plant();
  const Measurement good = record(plant, Experiment::multisine, 0.4);
  Measurement far = good;
  for (std::size_t k = 0; k < far.size(); ++k) far.cart_m[k] += 1e4 * far.time_s[k];
  auto found = find_mistakes({far}, plant);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].cause.find("cart_m travels"), 0u) << found[0].cause;
  Measurement fast = record(plant, Experiment::locked_swing, 0.4);
  for (std::size_t k = 0; k < fast.size(); ++k) fast.theta_rad[k] += 1e4 * fast.time_s[k];
  found = find_mistakes({fast}, plant);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].cause.find("theta_rad turns at"), 0u) << found[0].cause;
}

TEST_F(DataCheck, SaysFileLineAndTheWayRoundIt) {
  const Plant plant = paper_plant();
  const Measurement m = record(plant, Experiment::multisine, 0.4);
  write_csv(m, mistakes[0]);
  try {
    refuse_mistakes({read_measurement(dataset(m))}, plant);
    FAIL();
  } catch (const ConfigError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("record.csv"), std::string::npos) << text;
    EXPECT_NE(text.find("voltage_v: {column: u, scale: -1.0}"), std::string::npos) << text;
    EXPECT_NE(text.find("--trust-data"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace upright
