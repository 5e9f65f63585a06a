// The tables of a diagnosis matrix, from records made by hand.
#include "diagnosis_tables.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace upright::blind {
namespace {

using nlohmann::json;

json record(int number, std::vector<std::string> hidden, const std::string& verdict) {
  return {{"seed", 1},
          {"case", number},
          {"label", hidden.empty() ? "none" : hidden[0]},
          {"condition", "laboratory"},
          {"disturbed", false},
          {"size", "typical"},
          {"campaign", "mixed"},
          {"rate_hz", 500.0},
          {"experiments", {"multisine"}},
          {"hidden", hidden},
          {"unknown", false},
          {"truth", json::object()},
          {"known_effects", {"viscous_friction"}},
          {"verdict", verdict},
          {"found", json::array()},
          {"cpu_s", 2.0},
          {"gap_before", 6.0},
          {"gap_after", 1.0}};
}

json found(const std::string& kind) {
  return {
      {"kind", kind}, {"enters", "cart"}, {"confusable_with", json::array()}, {"parameters", json::object()}};
}

json unknown(int number, const std::string& verdict, double gap_after) {
  json r = record(number, {"gusts"}, verdict);
  r["unknown"] = true;
  r["gap_after"] = gap_after;
  return r;
}

/// The cells of a row of the tables.
std::string row(const Records& records, const std::string& name) {
  const std::string tables = tables_of(records);
  const std::size_t at = tables.find("| " + name);
  return at == std::string::npos ? "" : tables.substr(at, tables.find('\n', at) - at);
}

TEST(ShareBounds, AreThoseOfClopperAndPearson) {
  // No hit in 300: 1 - 0.05^(1/300). One in 20 and 19 of 20: from tables.
  EXPECT_NEAR(share_upper_bound(0.0, 300.0), 0.009936, 1e-6);
  EXPECT_NEAR(share_upper_bound(1.0, 20.0), 0.216106, 1e-5);
  EXPECT_NEAR(share_lower_bound(19.0, 20.0), 0.783894, 1e-5);
  EXPECT_EQ(share_upper_bound(20.0, 20.0), 1.0);
  EXPECT_EQ(share_lower_bound(0.0, 20.0), 0.0);
}

TEST(MatrixTables, FalseEffectsHaveABound) {
  Records records;
  for (int k = 0; k < 20; ++k) records.push_back(record(k, {}, "explained"));
  records[3]["found"].push_back(found("cogging_force"));
  EXPECT_NE(row(records, "false effect in cases").find("5.0 % (1 of 20), at most 21.6 %"), std::string::npos);
}

TEST(MatrixTables, WhatHelpsInPlacesIsNotNamed) {
  Records records = {record(0, {}, "explained")};
  records[0]["helps_here_only"] = {{{"kind", "cogging_force"}}};
  EXPECT_NE(row(records, "false effect in cases").find("0.0 % (0 of 1)"), std::string::npos);
}

TEST(MatrixTables, AShapeIsNoName) {
  Records records = {record(0, {}, "described")};
  records[0]["found"].push_back(found("force_table"));
  EXPECT_NE(row(records, "false effect in cases").find("0.0 % (0 of 1)"), std::string::npos);
  EXPECT_NE(row(records, "verdict described").find("100.0 % (1 of 1)"), std::string::npos);
}

TEST(MatrixTables, DescribedCountsAsRecognised) {
  const Records records = {unknown(0, "described", 1.0), unknown(1, "described", 3.0),
                           unknown(2, "unexplained", 6.0), unknown(3, "explained", 1.0)};
  EXPECT_NE(row(records, "unknown effect recognised").find("75.0 % (3 of 4)"), std::string::npos);
  EXPECT_NE(row(records, "unknown effect described").find("50.0 % (1 of 2)"), std::string::npos);
}

TEST(MatrixTables, LateCasesAreMissesAndStay) {
  json right = record(0, {"coulomb_friction"}, "explained");
  right["found"].push_back(found("coulomb_friction"));
  json late = record(1, {"coulomb_friction"}, "explained");
  late.erase("verdict");
  late.erase("found");
  late["failed"] = "diagnosis took too long";
  const Records records = {right, late};
  EXPECT_NE(row(records, "right set, including").find("50.0 % (1 of 2)"), std::string::npos);
  EXPECT_NE(row(records, "completed").find("50.0 % (1 of 2)"), std::string::npos);
  EXPECT_NE(tables_of(records).find("failed: diagnosis took too long"), std::string::npos);
}

TEST(MatrixTables, CoverageCountsIntervalsThatHold) {
  Records records;
  for (int k = 0; k < 4; ++k) {
    json r = record(k, {"coulomb_friction"}, "explained");
    r["truth"] = {{"coulomb_friction", {{"force_n", 1.0}}}};
    r["found"].push_back(found("coulomb_friction"));
    r["found"][0]["parameters"]["force_n"] = {{"value", 1.1}, {"low", k == 0 ? 1.05 : 0.9}, {"high", 1.2}};
    records.push_back(r);
  }
  EXPECT_NE(row(records, "95 % intervals").find("75.0 % (3 of 4)"), std::string::npos);
  EXPECT_NE(row(records, "parameter error, median").find("10 %"), std::string::npos);
}

TEST(MatrixTables, CoverageOfCorrectionsIsThatOfNulls) {
  Records records = {record(0, {}, "explained"), record(1, {"coulomb_friction"}, "explained")};
  for (json& r : records) {
    r["file_truth"] = {{"cart_mass", {{"scale", 1.03}}},
                       {"viscous_friction", {{"coefficient_n_per_mps", 3.0}}}};
    r["found"] = {found("cart_mass"), found("viscous_friction")};
    r["found"][0]["parameters"]["scale"] = {{"value", 1.02}, {"low", 1.0}, {"high", 1.04}};
    r["found"][1]["parameters"]["coefficient_n_per_mps"] = {{"value", 2.0}, {"low", 1.9}, {"high", 2.1}};
  }
  EXPECT_NE(row(records, "95 % intervals of corrected").find("50.0 % (1 of 2)"), std::string::npos);
}

TEST(MatrixTables, TimingCasesCountForTheirTimeOnly) {
  Records records = {record(0, {}, "explained"), record(1, {}, "unexplained"),
                     unknown(2, "unexplained", 1.0)};
  for (json& r : records) {
    r["timing"] = true;
    r["wall_s"] = 4.0 + 5.0 * r.at("case").get<double>();
  }
  records[1]["failed"] = "diagnosis took too long";
  EXPECT_NE(row(records, "the same, with something unknown").find("| <= 20 s | 14 s | holds"),
            std::string::npos);
  EXPECT_NE(row(records, "the same, slowest of all").find("| <= 40 s | inf s | **missed**"),
            std::string::npos);
  EXPECT_NE(row(records, "completed without").find("| - |"), std::string::npos);
}

TEST(MatrixRecords, ManyFilesCountEachCaseOnce) {
  const auto folder = std::filesystem::temp_directory_path() / "upright-matrix-records";
  std::filesystem::create_directories(folder);
  const std::string one = folder / "one.jsonl", two = folder / "two.jsonl";
  std::ofstream(one) << record(0, {}, "explained").dump() << "\n"
                     << record(1, {}, "explained").dump() << "\n";
  std::ofstream(two) << record(1, {}, "explained").dump() << "\n"
                     << record(2, {}, "explained").dump() << "\n"
                     << "{\"seed\": 1, \"ca";
  EXPECT_EQ(read_records({one, two}).size(), 3u);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace upright::blind
