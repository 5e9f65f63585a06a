// What other people's programs write as a table of numbers, each read as the same measurement, and what is no
// such table, named for what it is.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "measurement_folder.hpp"

namespace upright {
namespace {

using namespace std::string_literals;

class CsvFormats : public MeasurementFolder {
 protected:
  std::filesystem::path dataset(const std::string& csv, const std::string& more = "") const {
    return file("dataset.yaml", "dataset:\n  file: " + csv +
                                    "\n  columns: {time_s: time_s, cart_m: cart_m, voltage_v: voltage_v}\n" +
                                    more);
  }
  static constexpr int rows = 120;
  static double cart_at(int k) { return 0.001 * (k * k % 97); }

  /// The same table in another dress.
  static std::string table(char delimiter = ',', char decimal = '.', const std::string& end = "\n",
                           const std::string& units = "", int hole = -1, const std::string& in_hole = "") {
    const std::string d(1, delimiter);
    std::string text = "time_s" + d + "cart_m" + d + "voltage_v" + end;
    if (!units.empty()) text += units + end;
    const auto number = [&](double value) {
      std::string digits = std::to_string(value);
      digits[digits.find('.')] = decimal;
      return digits;
    };
    for (int k = 0; k < rows; ++k)
      text += number(0.01 * k) + d + (k == hole ? in_hole : number(cart_at(k))) + d + number(1.5) + end;
    return text;
  }

  static void expect_table(const Measurement& m) {
    ASSERT_EQ(m.size(), static_cast<std::size_t>(rows));
    for (int k = 0; k < rows; ++k) {
      EXPECT_NEAR(m.time_s[static_cast<std::size_t>(k)], 0.01 * k, 1e-12);
      EXPECT_NEAR(m.cart_m[static_cast<std::size_t>(k)], cart_at(k), 1e-12);
      EXPECT_EQ(m.voltage_v[static_cast<std::size_t>(k)], 1.5);
    }
    EXPECT_TRUE(m.breaks.empty());
  }
};

TEST_F(CsvFormats, MeanTheSame) {
  const std::string quoted = "\"time_s\",\"cart_m\",\"voltage_v\"" + table().substr(table().find('\n'));
  for (const std::string& text :
       {table(), "\xef\xbb\xbf" + table(), table(',', '.', "\r\n"), table(',', '.', "\r"), table('\t'),
        table(' '), table(';'), table(';', ','), table('\t', ','), "\xef\xbb\xbf" + table(';', ',', "\r\n"),
        "# a comment\n" + table(), "% of MATLAB\n" + table(), quoted, table(',', '.', "\n", "s,m,V"),
        table(';', ',', "\r\n", "[s];[m];[V]"), table(';', '.', "\n", "(s);(m);(V)")}) {
    SCOPED_TRACE(text.substr(0, 60));
    expect_table(read_measurement(file("a.csv", text)));
  }
}

TEST_F(CsvFormats, CanBeSaidInTheDatasetFile) {
  file("a.csv", table(';', ','));
  expect_table(read_measurement(dataset("a.csv", "  delimiter: semicolon\n  decimal: comma\n")));
  EXPECT_NE(refusal(dataset("a.csv", "  delimiter: comma\n  decimal: comma\n")).find("decimal"),
            std::string::npos);
  EXPECT_NE(refusal(dataset("a.csv", "  delimiter: pipe\n")).find("semicolon"), std::string::npos);
}

TEST_F(CsvFormats, WithoutANumberInACellAreAGapUnlessToldOtherwise) {
  for (const std::string& hole : {""s, "NaN"s, "nan"s, "NA"s, "-nan"s, "inf"s, "#N/A"s, "null"s}) {
    SCOPED_TRACE(hole);
    file("a.csv", table(',', '.', "\n", "", 20, hole));
    const Measurement gap = read_measurement(folder_ / "a.csv");
    EXPECT_EQ(gap.size(), rows - 1u);
    EXPECT_EQ(gap.missing_rows, 1u);
    ASSERT_EQ(gap.breaks.size(), 1u);
    EXPECT_EQ(gap.breaks[0], 20u);
    ASSERT_EQ(gap.notes.size(), 1u);
    EXPECT_NE(gap.notes[0].find("1 of 120 rows"), std::string::npos) << gap.notes[0];
    EXPECT_NE(gap.notes[0].find("line 22"), std::string::npos) << gap.notes[0];
    const Measurement skipped = read_measurement(dataset("a.csv", "  missing: skip\n"));
    EXPECT_EQ(skipped.size(), rows - 1u);
    EXPECT_TRUE(skipped.breaks.empty());
    const std::string stopped = refusal(dataset("a.csv", "  missing: stop\n"));
    EXPECT_NE(stopped.find("a.csv:22:"), std::string::npos) << stopped;
  }
}

TEST_F(CsvFormats, RefuseTextAndMixedSignsWithFileAndLine) {
  const auto in_cell = [&](const std::string& text, char delimiter = ',') {
    return refusal(file("a.csv", table(delimiter, '.', "\n", "", 20, text)));
  };
  EXPECT_NE(in_cell("abc").find("a.csv:22: cart_m is 'abc'"), std::string::npos);
  EXPECT_NE(in_cell("1,5", ';').find("decimal sign"), std::string::npos);
  EXPECT_NE(in_cell("1.234,5", ';').find("a.csv:22:"), std::string::npos);
  EXPECT_NE(in_cell("0.1,0.2").find("4 cells"), std::string::npos);
  EXPECT_NE(refusal(file("b.csv", table(',', ','))).find("semicolons"), std::string::npos);
  const std::string no_names = table().substr(table().find('\n') + 1);
  EXPECT_NE(refusal(file("c.csv", no_names)).find("header: false"), std::string::npos);
}

TEST_F(CsvFormats, NameTheirUnitsInARowOrInTheHeader) {
  const Measurement named = read_measurement(file("a.csv", table(',', '.', "\n", "ms,mm,V")));
  EXPECT_NEAR(named.time_s[1], 1e-3 * read_measurement(file("b.csv", table())).time_s[1], 1e-15);
  EXPECT_NEAR(named.cart_m[1], 1e-6, 1e-12);
  ASSERT_EQ(named.notes.size(), 2u);
  EXPECT_NE(named.notes[1].find("cart_m is in mm"), std::string::npos) << named.notes[1];
  // In the names of the columns.
  const std::string body = table().substr(table().find('\n'));
  const auto in_names = [&](const std::string& header, const std::string& columns) {
    file("a.csv", header + body);
    return file("d.yaml", "dataset:\n  file: a.csv\n  columns: {" + columns + ", voltage_v: u}\n");
  };
  const Measurement bracketed =
      read_measurement(in_names("t [ms],x (cm),u", "time_s: \"t [ms]\", cart_m: \"x (cm)\""));
  EXPECT_NEAR(bracketed.time_s[1], named.time_s[1], 1e-15);
  EXPECT_NEAR(bracketed.cart_m[1], 1e-5, 1e-12);
  // The dataset file knows better.
  const Measurement scaled = read_measurement(
      in_names("t [ms],x (cm),u", "time_s: \"t [ms]\", cart_m: {column: \"x (cm)\", scale: 0.5}"));
  EXPECT_NEAR(scaled.cart_m[1], 5e-4, 1e-12);
  const std::string counts = refusal(in_names("t,x [counts],u", "time_s: t, cart_m: \"x [counts]\""));
  EXPECT_NE(counts.find("unit: counts, m_per_count"), std::string::npos) << counts;
}

TEST_F(CsvFormats, AreToldFromOtherFiles) {
  std::string utf16;
  for (const char c : table()) utf16 += c + "\0"s;
  const std::string version_5 = "MATLAB 5.0 MAT-file, Platform: GLNXA64" + std::string(90, ' ') + "\0\1IM"s;
  std::string version_73 = "MATLAB 7.3 MAT-file, Platform: GLNXA64";
  version_73.resize(512, ' ');
  version_73 += "\x89HDF\r\n\x1a\n";
  struct Other {
    std::string text, named, remedy;
  };
  for (const Other& other :
       {Other{"\xff\xfe" + utf16, "UTF-16", "iconv"}, Other{utf16, "UTF-16", "iconv"},
        Other{version_5, "no MATLAB file that can be read", "save it again"},
        Other{version_73, "no MATLAB file that can be read", "save it again"},
        Other{"\x89HDF\r\n\x1a\n"s, "HDF5", "h5py"}, Other{"PK\x03\x04"s, "spreadsheet", "CSV"},
        Other{table() + "\0"s, "zero byte", "CSV"}}) {
    const std::string refused = refusal(file("a.csv", other.text));
    EXPECT_NE(refused.find(other.named), std::string::npos) << refused;
    EXPECT_NE(refused.find(other.remedy), std::string::npos) << refused;
    EXPECT_NE(refused.find("a.csv:"), std::string::npos) << refused;
  }
}

TEST_F(CsvFormats, NameTheColumnsThatAreThere) {
  file("a.csv", "t;x;u\n" + table(';').substr(table(';').find('\n') + 1));
  EXPECT_NE(refusal(folder_ / "a.csv").find("t, x, u"), std::string::npos) << refusal(folder_ / "a.csv");
  const std::string misspelt =
      refusal(file("d.yaml", "dataset:\n  file: a.csv\n  columns: {time_s: t, cart_m: y, voltage_v: u}\n"));
  EXPECT_NE(misspelt.find("no column 'y'"), std::string::npos) << misspelt;
}

/// The blocks in which a file is read show nowhere.
TEST_F(CsvFormats, MayBeLong) {
  constexpr int many = 150000;
  std::string text = "time_s,cart_m,voltage_v\n";
  for (int k = 0; k < many; ++k)
    text += std::to_string(1e-3 * k) + "," + std::to_string(1e-5 * (k % 1009)) + ",0.5\n";
  const Measurement m = read_measurement(file("a.csv", text));
  ASSERT_EQ(m.size(), static_cast<std::size_t>(many));
  for (int k = 0; k < many; ++k) {
    ASSERT_NEAR(m.time_s[static_cast<std::size_t>(k)], 1e-3 * k, 1e-9);
    ASSERT_NEAR(m.cart_m[static_cast<std::size_t>(k)], 1e-5 * (k % 1009), 1e-12);
  }
}

}  // namespace
}  // namespace upright
