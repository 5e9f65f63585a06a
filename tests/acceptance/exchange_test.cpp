// `upright import` and `upright export` as a user runs them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class Exchange : public ::testing::Test {
 protected:
  /// A record with decimal commas, units in the header, and columns that nobody asked for.
  fs::path foreign_table() const {
    std::string rows = "Zeit [ms];Weg [mm];Winkel [deg];Sollwert;Spannung\n";
    for (int k = 0; k < 1000; ++k) {
      const double t = 0.002 * k;
      char row[120];
      std::snprintf(row, sizeof row, "%.1f;%.4f;%.4f;0;%.2f\n", 1e3 * t, 100.0 * std::sin(3.0 * t),
                    180.0 + 20.0 * std::cos(5.0 * t), k % 100 < 50 ? 1.5 : -1.5);
      rows += row;
    }
    for (char& c : rows)
      if (c == '.') c = ',';
    return folder_.write("measured.csv", rows);
  }
  fs::path run() const {
    const CommandResult result = run_upright("run --fast --rig " UPRIGHT_SOURCE_DIR
                                             "/config/rigs/simulated.yaml --gains " UPRIGHT_SOURCE_DIR
                                             "/config/gains/exponential.yaml --duration 1 --out " +
                                             folder_.path().string());
    const std::size_t end = result.out.find_last_not_of('\n');
    const std::size_t begin = result.out.rfind('\n', end) + 1;
    return result.out.substr(begin, end + 1 - begin);
  }
  Json imported(const fs::path& file, int exit_code = 0) const {
    const CommandResult result = run_upright("import --json " + shell_quoted(file.string()));
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    return Json::parse(result.out);
  }

  TemporaryFolder folder_;
};

TEST_F(Exchange, ImportProposesAMappingThatReads) {
  const Json document = imported(foreign_table());
  EXPECT_EQ(document.at("rows"), 1000);
  EXPECT_EQ(document.at("complete"), true);
  EXPECT_EQ(document.at("columns").at("time_s").at("column"), "Zeit [ms]");
  EXPECT_EQ(document.at("columns").at("cart_m").at("column"), "Weg [mm]");
  EXPECT_EQ(document.at("columns").at("theta_rad").at("column"), "Winkel [deg]");
  EXPECT_EQ(document.at("columns").at("voltage_v").at("column"), "Spannung");
  EXPECT_EQ(document.at("not_used"), Json::array({"Sollwert"}));
  ASSERT_EQ(document.at("notes").size(), 3u) << "units of time, way and angle";
  const std::string dataset = document.at("dataset"),
                    page = read_text(document.at("page").get<std::string>());
  EXPECT_EQ(run_upright("check " + dataset).exit_code, 0);
  for (const char* text : {"<svg", "pendulum angle", "First 5 s of measured"})
    EXPECT_NE(page.find(text), std::string::npos) << text;
  // Nothing is written over.
  const CommandResult again = run_upright("import " + (folder_.path() / "measured.csv").string());
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("already exists"), std::string::npos) << again.err;
}

TEST_F(Exchange, ImportUnderstandsUsualNames) {
  struct Named {
    const char *header, *time, *cart, *theta, *voltage;
  };
  for (const Named& named :
       {Named{"t_s,qm_m,qg_m,vir_V", "t_s", "qm_m", nullptr, "vir_V"},
        Named{"time,theta_dot,theta,x_dot,x,u", "time", "x", "theta", "u"},
        Named{"Time_ms,CartPosition_mm,CartVelocity,PendulumAngle_deg,MotorVoltage_V", "Time_ms",
              "CartPosition_mm", "PendulumAngle_deg", "MotorVoltage_V"},
        Named{"voltage,alpha,position,timestamp", "timestamp", "position", "alpha", "voltage"}}) {
    SCOPED_TRACE(named.header);
    fs::remove(folder_.path() / "named.yaml");
    std::string text = std::string(named.header) + "\n";
    const auto cells = std::count(text.begin(), text.end(), ',');
    for (int k = 0; k < 30; ++k) {
      for (int c = 0; c <= cells; ++c) text += (c > 0 ? "," : "") + std::to_string(k + 0.01 * k * k + c);
      text += "\n";
    }
    const Json columns = imported(folder_.write("named.csv", text)).at("columns");
    const auto expect = [&](const char* quantity, const char* column) {
      if (column == nullptr)
        EXPECT_TRUE(columns.at(quantity).is_null()) << columns;
      else
        EXPECT_EQ(columns.at(quantity).at("column"), column) << columns;
    };
    expect("time_s", named.time);
    expect("cart_m", named.cart);
    expect("theta_rad", named.theta);
    expect("voltage_v", named.voltage);
  }
}

TEST_F(Exchange, ImportSaysWhatItCouldNotFind) {
  std::string rows = "t,foo,bar\n";
  for (int k = 0; k < 20; ++k) rows += std::to_string(0.01 * k) + "," + std::to_string(k % 5) + ",0\n";
  const fs::path file = folder_.write("unknown.csv", rows);
  const CommandResult result = run_upright("import " + file.string());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.out.find("# voltage_v: no column was recognised"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("# not used: foo, bar"), std::string::npos) << result.out;
  EXPECT_NE(result.err.find("was recognised for voltage_v, theta_rad, cart_m: complete "), std::string::npos)
      << result.err;
}

TEST_F(Exchange, ExportWritesWhatIsReadAgain) {
  const fs::path directory = run(), mat = folder_.path() / "run.mat", csv = folder_.path() / "run.csv";
  EXPECT_EQ(run_upright("export " + directory.string() + " --mat --out " + mat.string()).out,
            mat.string() + "\n");
  EXPECT_EQ(run_upright("export " + directory.string() + " --csv --out " + csv.string()).out,
            csv.string() + "\n");
  // Read back, both say what the run directory says.
  const fs::path from_mat = folder_.path() / "from-mat.csv", from_csv = folder_.path() / "from-csv.csv";
  EXPECT_EQ(run_upright("export " + mat.string() + " --csv --out " + from_mat.string()).exit_code, 0);
  EXPECT_EQ(run_upright("export " + csv.string() + " --csv --out " + from_csv.string()).exit_code, 0);
  const std::string text = read_text(from_mat);
  EXPECT_EQ(text, read_text(from_csv));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1001);
  EXPECT_EQ(text.rfind("time_s,voltage_v,cart_m,theta_rad\n", 0), 0u);
  const std::string samples = read_text(directory / "samples.csv");
  EXPECT_EQ(std::count(samples.begin(), samples.end(), '\n'), 1001);
}

TEST_F(Exchange, ExportRefusesWhatMakesNoSense) {
  const fs::path table = foreign_table();
  for (const std::string& flags : {std::string(), std::string("--mat --csv"), "--csv --out " + table.string(),
                                   std::string("--mat --out /none/at/all.mat")}) {
    const CommandResult result = run_upright("export " + table.string() + " " + flags);
    EXPECT_EQ(result.exit_code, 2) << flags;
    EXPECT_FALSE(result.err.empty());
  }
}

}  // namespace
}  // namespace upright::testing
