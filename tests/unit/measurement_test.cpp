#include "upright/measurement/measurement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "measurement/long_records.hpp"
#include "measurement_folder.hpp"

namespace upright {
namespace {

class MeasurementFile : public MeasurementFolder {
 protected:
  static std::string rows(const std::string& header, const std::string& bad_row = "") {
    std::string text = header + "\n";
    for (int k = 0; k < 40; ++k)
      text += std::to_string(0.01 * k) + "," + std::to_string(0.001 * (k % 7)) + ",1.0\n";
    return text + bad_row;
  }

  /// A cart that does not move.
  static std::string still() {
    std::string text = "time_s,cart_m,voltage_v\n";
    for (int k = 0; k < 40; ++k) text += std::to_string(0.01 * k) + ",0.5,1\n";
    return text;
  }
};

TEST_F(MeasurementFile, ReadsAPlainCsv) {
  const Measurement m = read_measurement(file("a.csv", rows("time_s,cart_m,voltage_v")));
  EXPECT_EQ(m.size(), 40u);
  EXPECT_TRUE(m.has_cart());
  EXPECT_FALSE(m.has_theta());
  EXPECT_NEAR(m.cart_resolution_m, 0.001, 1e-9);
  EXPECT_NEAR(m.median_period_s(), 0.01, 1e-9);
}

TEST_F(MeasurementFile, MapsScalesAndNumbersForeignColumns) {
  file("foreign.csv", rows("t,qm,vir"));
  const Measurement m =
      read_measurement(file("d.yaml",
                            "dataset:\n  file: foreign.csv\n  columns: {time_s: t, cart_m: {column: qm, "
                            "scale: 2.0, offset: 1.0}, voltage_v: vir}\n"));
  EXPECT_NEAR(m.cart_m[1], 1.002, 1e-12);
  std::string bare = rows("");
  bare.erase(0, 1);
  file("bare.csv", bare);
  const Measurement n = read_measurement(
      file("e.yaml",
           "dataset:\n  file: bare.csv\n  header: false\n  columns: {time_s: 1, cart_m: 2, voltage_v: 3}\n"));
  EXPECT_EQ(n.size(), 40u);
}

TEST_F(MeasurementFile, RefusesWhatCannotBeUsedAndSaysWhere) {
  EXPECT_NE(refusal(file("a.csv", rows("t,q,u"))).find("time_s"), std::string::npos);
  EXPECT_NE(refusal(file("b.csv", "time_s,cart_m,voltage_v\n0,0,0\n")).find("fewer than 10"),
            std::string::npos);
  EXPECT_NE(refusal(file("c.csv", rows("time_s,cart_m,voltage_v", "0.4,fast,1\n"))).find(":42:"),
            std::string::npos);
  EXPECT_NE(
      refusal(file("d.csv", rows("time_s,cart_m,voltage_v", "0.1,0.002,1\n"))).find("does not increase"),
      std::string::npos);
  EXPECT_NE(refusal(file("e.csv", still())).find("constant"), std::string::npos);
  EXPECT_NE(refusal(folder_ / "missing.csv").find("cannot read"), std::string::npos);
  EXPECT_NE(refusal(file("f.csv", rows("time_s,cart_m,none"))).find("voltage_v"), std::string::npos);
}

TEST_F(MeasurementFile, LeavesOutWhatDoesNotMoveBesideWhatDoes) {
  const auto a = file("still.csv", still()), b = file("b.csv", rows("time_s,cart_m,voltage_v"));
  const std::vector<Measurement> runs = read_measurements({a, b});
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].name, "b");
  ASSERT_EQ(runs[0].notes.size(), 1u);
  EXPECT_NE(runs[0].notes[0].find("still.csv is left out"), std::string::npos);
  EXPECT_THROW(read_measurements({a, a}), ConfigError);
  EXPECT_THROW(read_measurements({b, file("short.csv", "time_s,cart_m,voltage_v\n0,0,0\n")}), ConfigError);
}

TEST(LongRecords, AreCutToPiecesThatAreSpreadEvenly) {
  Measurement run;
  run.name = "long";
  constexpr std::size_t many = 200000;
  for (std::size_t k = 0; k < many; ++k) {
    run.time_s.push_back(1e-3 * static_cast<double>(k));
    run.voltage_v.push_back(static_cast<double>(k));
    run.cart_m.push_back(static_cast<double>(k));
  }
  run.cart_weight.assign(many, 1.0);
  run.breaks = {100000, 100100};
  EXPECT_EQ(within_samples({run}, many).front().size(), many) << "what is short enough stays whole";
  const std::vector<Measurement> kept = within_samples({run}, 50000);
  ASSERT_EQ(kept.size(), 1u);
  const Measurement& m = kept[0];
  EXPECT_NEAR(static_cast<double>(m.size()), 50000.0, 10.0);
  EXPECT_EQ(m.cart_m.size(), m.size());
  EXPECT_EQ(m.cart_weight.size(), m.size());
  EXPECT_TRUE(m.theta_rad.empty());
  ASSERT_EQ(m.notes.size(), 1u);
  EXPECT_NE(m.notes[0].find("200000 samples"), std::string::npos) << m.notes[0];
  // Every jump is a break, and the record's own breaks are where they were.
  std::vector<std::size_t> jumps;
  for (std::size_t k = 1; k < m.size(); ++k)
    if (m.cart_m[k] != m.cart_m[k - 1] + 1.0 || m.cart_m[k] == 100000.0 || m.cart_m[k] == 100100.0)
      jumps.push_back(k);
  EXPECT_EQ(m.breaks, jumps);
  EXPECT_LT(m.cart_m.front(), 30000.0);
  EXPECT_GT(m.cart_m.back(), 170000.0);
}

TEST(LongRecords, OfManyShortRunsEveryNthIsKept) {
  std::vector<Measurement> runs(100);
  for (Measurement& run : runs)
    for (int k = 0; k < 1000; ++k) {
      run.time_s.push_back(1e-3 * k);
      run.voltage_v.push_back(0.0);
    }
  const std::vector<Measurement> kept = within_samples(runs, 25000);
  EXPECT_EQ(kept.size(), 25u);
  for (const Measurement& run : kept) EXPECT_EQ(run.size(), 1000u);
}

TEST(Resolution, IsFoundWhereThereAreStepsAndNowhereElse) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<double> steps, smooth;
  for (int k = 0; k < 2000; ++k) {
    const double value = 0.1 * std::sin(0.01 * k);
    steps.push_back(2.3e-5 * std::floor(value / 2.3e-5));
    smooth.push_back(value + 1e-4 * noise(random));
  }
  EXPECT_NEAR(find_resolution(steps), 2.3e-5, 1e-9);
  EXPECT_EQ(find_resolution(smooth), 0.0);
  EXPECT_NEAR(find_noise(smooth), 1e-4, 1e-5);
}

TEST(Resolution, IsNoStepThatIsSmallByChance) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0.0, 1.0);
  int found = 0;
  for (int draw = 0; draw < 1000; ++draw) {
    std::vector<double> values;
    for (int k = 0; k < 500; ++k) values.push_back(0.1 * std::sin(0.01 * k) + 1e-4 * noise(random));
    if (find_resolution(values) > 0.0) ++found;
  }
  EXPECT_LE(found, 5) << "of 1000 signals that are not quantised";
}

TEST(Resolution, IsThatOfFewStepsOfARestingCart) {
  std::vector<double> values(400, 0.0);
  for (std::size_t k = 100; k < values.size(); ++k) values[k] = (k < 200 ? 1.0 : 2.0) * 2.3e-5;
  EXPECT_NEAR(find_resolution(values), 2.3e-5, 1e-12);
}

}  // namespace
}  // namespace upright
