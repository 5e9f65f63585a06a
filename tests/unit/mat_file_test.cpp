// MATLAB files as measured data: what MATIO writes in v5 and v7.3.
#include "measurement/mat_file.hpp"

#include <gtest/gtest.h>
#include <matio.h>

#include <cmath>

#include "measurement_folder.hpp"

namespace upright {
namespace {

constexpr std::size_t rows = 200;

double time_s(std::size_t k) {
  return 0.002 * static_cast<double>(k);
}
double way_m(std::size_t k) {
  return 0.1 * std::sin(3.0 * time_s(k));
}
double volts(std::size_t k) {
  return k % 40 < 20 ? 1.5 : -1.5;
}

std::vector<double> column(double (*value)(std::size_t), double scale = 1.0) {
  std::vector<double> values;
  for (std::size_t k = 0; k < rows; ++k) values.push_back(scale * value(k));
  return values;
}

matvar_t* matrix(const char* name, std::vector<double> values, std::vector<std::size_t> size) {
  return Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, static_cast<int>(size.size()), size.data(),
                       values.data(), 0);
}

/// Both formats, with a file for each.
class MatFiles : public MeasurementFolder, public testing::WithParamInterface<mat_ft> {
 protected:
  std::filesystem::path mat(const std::vector<matvar_t*>& variables) const {
    const std::filesystem::path path = folder_ / "measured.mat";
    std::filesystem::remove(path);
    mat_t* file = Mat_CreateVer(path.c_str(), nullptr, GetParam());
    for (matvar_t* variable : variables) {
      EXPECT_EQ(Mat_VarWrite(file, variable, MAT_COMPRESSION_ZLIB), 0);
      Mat_VarFree(variable);
    }
    Mat_Close(file);
    return path;
  }

  Measurement mapped(const std::string& columns) const {
    return read_measurement(file("d.yaml", "dataset:\n  file: measured.mat\n  columns: {" + columns + "}\n"));
  }
  std::string refused(const std::string& columns) const {
    return refusal(file("d.yaml", "dataset:\n  file: measured.mat\n  columns: {" + columns + "}\n"));
  }

  static void expect_motion(const Measurement& m) {
    ASSERT_EQ(m.size(), rows);
    for (std::size_t k = 0; k < rows; ++k) {
      EXPECT_DOUBLE_EQ(m.time_s[k], time_s(k));
      EXPECT_NEAR(m.cart_m[k], way_m(k), 1e-15);
      EXPECT_DOUBLE_EQ(m.voltage_v[k], volts(k));
    }
  }
};

TEST_P(MatFiles, WithTheNamesOfTheQuantitiesNeedNoDatasetFile) {
  expect_motion(read_measurement(
      mat({matrix("time_s", column(time_s), {rows, 1}), matrix("cart_m", column(way_m), {1, rows}),
           matrix("voltage_v", column(volts), {rows, 1})})));
}

TEST_P(MatFiles, GiveColumnsOfAMatrixWithUnits) {
  std::vector<double> all = column(time_s, 1e3), x = column(way_m, 1e3), u = column(volts, 1e3);
  all.insert(all.end(), x.begin(), x.end());
  all.insert(all.end(), u.begin(), u.end());
  mat({matrix("data", all, {rows, 3})});
  const Measurement m = mapped(
      "time_s: {column: \"data(:,1)\", unit: ms}, cart_m: {column: \"data(:,2)\", unit: mm}, voltage_v: "
      "{column: \"data(:, 3)\", unit: mV}");
  ASSERT_EQ(m.size(), rows);
  EXPECT_NEAR(m.time_s[7], time_s(7), 1e-12);
  EXPECT_NEAR(m.cart_m[7], way_m(7), 1e-12);
  EXPECT_NEAR(m.voltage_v[7], volts(7), 1e-12);
  EXPECT_NE(refused("time_s: data, cart_m: data, voltage_v: data").find("name one, as data(:,1)"),
            std::string::npos);
}

/// As Simulink logs it: time, and an array of signals with a matrix each.
TEST_P(MatFiles, GiveAStructureWithTime) {
  const char* const signal_fields[] = {"values", "label"};
  std::vector<double> both = column(way_m), u = column(volts);
  matvar_t* signals = Mat_VarCreateStruct2("signals", 2, std::vector<std::size_t>{1, 2}.data(),
                                           std::vector<const char*>{signal_fields[0], nullptr}.data());
  Mat_VarSetStructFieldByName(signals, "values", 0, matrix("values", both, {rows, 1}));
  Mat_VarSetStructFieldByName(signals, "values", 1, matrix("values", u, {1, 1, rows}));
  matvar_t* log = Mat_VarCreateStruct2("log", 2, std::vector<std::size_t>{1, 1}.data(),
                                       std::vector<const char*>{"time", "signals", nullptr}.data());
  Mat_VarSetStructFieldByName(log, "time", 0, matrix("time", column(time_s), {rows, 1}));
  Mat_VarSetStructFieldByName(log, "signals", 0, signals);
  const std::filesystem::path path = mat({log});
  std::vector<std::string> listed;
  for (const MatVector& vector : MatFile(path).vectors()) listed.push_back(vector.path);
  EXPECT_EQ(listed, (std::vector<std::string>{"log.time", "log.signals(1).values", "log.signals(2).values"}));
  expect_motion(
      mapped("time_s: log.time, cart_m: \"log.signals(1).values\", voltage_v: \"log.signals(2).values\""));
}

TEST_P(MatFiles, MayHoldWholeNumbersAndCountsOfEncoders) {
  std::vector<std::int16_t> counts;
  for (std::size_t k = 0; k < rows; ++k) counts.push_back(static_cast<std::int16_t>(100 * (k % 7)));
  std::vector<std::size_t> size = {rows, 1};
  mat({matrix("t", column(time_s), {rows, 1}), matrix("u", column(volts), {rows, 1}),
       Mat_VarCreate("enc", MAT_C_INT16, MAT_T_INT16, 2, size.data(), counts.data(), 0)});
  const Measurement m = mapped(
      "time_s: t, voltage_v: u, cart_m: {column: enc, unit: counts, m_per_count: 2.0e-5}, theta_rad: "
      "{column: "
      "enc, unit: counts, counts_per_revolution: 4000}");
  EXPECT_NEAR(m.cart_m[5], 500 * 2e-5, 1e-15);
  EXPECT_NEAR(m.theta_rad[5], 500 * 2.0 * M_PI / 4000, 1e-12);
}

TEST_P(MatFiles, AreRefusedWithTheReason) {
  std::vector<double> holes = column(way_m);
  mat({matrix("t", column(time_s), {rows, 1}), matrix("u", column(volts), {rows, 1}),
       matrix("x", holes, {rows, 1}), matrix("short", std::vector<double>(rows - 1, 0.5), {rows - 1, 1}),
       Mat_VarCreate("words", MAT_C_CHAR, MAT_T_UTF8, 2, std::vector<std::size_t>{1, 3}.data(),
                     const_cast<char*>("abc"), 0)});
  EXPECT_NE(refused("time_s: t, cart_m: y, voltage_v: u").find("no column 'y' (the columns are: "),
            std::string::npos)
      << refused("time_s: t, cart_m: y, voltage_v: u");
  EXPECT_NE(refused("time_s: t, cart_m: short, voltage_v: u").find("199 values, but t has 200"),
            std::string::npos);
  EXPECT_NE(refused("time_s: t, cart_m: words, voltage_v: u").find("no real vector"), std::string::npos);
  for (const char* path :
       {"x(", "x(0)", "x(:,2)", "x.y", "x(1).y", "x{1}", "(:,1)", "x(:,9999999999999999999)"})
    EXPECT_FALSE(refused("time_s: t, cart_m: \"" + std::string(path) + "\", voltage_v: u").empty()) << path;
  EXPECT_NE(
      refused("time_s: t, cart_m: {column: x, unit: furlong}, voltage_v: u").find("use one of m, dm, cm"),
      std::string::npos);
  EXPECT_NE(refused("time_s: t, cart_m: {column: x, unit: mm, scale: 2}, voltage_v: u").find("beside scale"),
            std::string::npos);
  EXPECT_NE(refused("time_s: t, cart_m: {column: x, unit: counts}, voltage_v: u").find("m_per_count"),
            std::string::npos);
}

TEST_P(MatFiles, ThatAreCutOrGarbledAreRefusedOrRead) {
  const std::filesystem::path path =
      mat({matrix("time_s", column(time_s), {rows, 1}), matrix("cart_m", column(way_m), {rows, 1}),
           matrix("voltage_v", column(volts), {rows, 1})});
  std::ifstream in(path, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  for (std::size_t part = 0; part < 8; ++part)
    EXPECT_FALSE(refusal(file("cut.mat", whole.substr(0, whole.size() * part / 8))).empty()) << part;
}

INSTANTIATE_TEST_SUITE_P(Both, MatFiles, testing::Values(MAT_FT_MAT5, MAT_FT_MAT73),
                         [](const auto& one) { return one.param == MAT_FT_MAT5 ? "v5" : "v73"; });

using MatWriter = MeasurementFolder;

TEST_F(MatWriter, WritesWhatTheReaderReads) {
  const std::filesystem::path path = folder_ / "out.mat";
  write_mat_file(path, {{"time_s", column(time_s)}, {"cart_m", column(way_m)}});
  const MatFile mat(path);
  EXPECT_EQ(mat.values("time_s"), column(time_s));
  EXPECT_EQ(mat.values("cart_m"), column(way_m));
  EXPECT_TRUE(mat.values("voltage_v").empty());
  EXPECT_THROW(write_mat_file(folder_ / "none" / "out.mat", {}), ConfigError);
}

}  // namespace
}  // namespace upright
