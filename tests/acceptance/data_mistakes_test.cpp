// Mistakes in how measured data are described, as a user makes them: the commands stop before any search,
// with exit code 2 and the line that undoes the mistake; with that line they go on.
#include <gtest/gtest.h>

#include <string>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
const std::string source = UPRIGHT_SOURCE_DIR;

struct Slip {
  const char* name;
  const char* wrong;  ///< the dataset file's line that reads the quantity wrongly
  const char* right;  ///< the line that the message must hold
};

void PrintTo(const Slip& slip, std::ostream* out) {
  *out << slip.name;
}

const Slip slips[] = {
    {"voltage_sign", "voltage_v: {column: voltage_v, scale: -1}", "voltage_v: {column: voltage_v}"},
    {"angle_sign", "theta_rad: {column: theta_rad, scale: -1}", "theta_rad: {column: theta_rad}"},
    {"cart_sign", "cart_m: {column: cart_m, scale: -1}", "cart_m: {column: cart_m}"},
    {"degrees", "theta_rad: {column: theta_rad, scale: 57.29577951308232}", "theta_rad: {column: theta_rad}"},
    {"hanging_zero", "theta_rad: {column: theta_rad, offset: -3.141592653589793}",
     "theta_rad: {column: theta_rad}"},
    {"millimetres", "cart_m: {column: cart_m, scale: 1000}", "cart_m: {column: cart_m}"},
    {"milliseconds", "time_s: {column: time_s, scale: 1000}", "time_s: {column: time_s}"},
};

class DataMistakes : public ::testing::TestWithParam<Slip> {
 protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    const CommandResult run =
        run_upright("run --rig " + source + "/config/rigs/simulated.yaml --gains " + source +
                    "/config/gains/viscous.yaml --theta0-deg 3 --duration 4 --fast --out " +
                    shell_quoted(folder->path().string()));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    for (const auto& entry : fs::directory_iterator(folder->path()))
      if (fs::exists(entry.path() / "samples.csv")) samples = entry.path() / "samples.csv";
  }
  static void TearDownTestSuite() { delete folder; }

  /// A dataset file in which one line is another.
  static std::string dataset(const std::string& line) {
    std::string text = "dataset:\n  file: " + samples.string() + "\n  columns:\n";
    for (const char* quantity : {"time_s", "voltage_v", "cart_m", "theta_rad"}) {
      const std::string plain = std::string(quantity) + ": " + quantity;
      text += "    " + (line.starts_with(std::string(quantity) + ":") ? line : plain) + "\n";
    }
    return shell_quoted(folder->write("data.yaml", text).string());
  }

  static inline TemporaryFolder* folder = nullptr;
  static inline fs::path samples;
};

TEST_P(DataMistakes, StopTheCommandsWithTheLineThatUndoesThem) {
  const std::string plant = source + "/config/plants/viscous.yaml";
  for (const std::string command : {"diagnose --model ", "identify --plant "}) {
    const CommandResult result = run_upright(command + plant + " --data " + dataset(GetParam().wrong));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err.find(GetParam().right), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("samples.csv"), std::string::npos) << result.err;
  }
}

INSTANTIATE_TEST_SUITE_P(Slips, DataMistakes, ::testing::ValuesIn(slips),
                         [](const auto& slip) { return std::string(slip.param.name); });

class DataWithoutMistake : public DataMistakes {};

/// Without a mistake, and with one that is passed over, the search is made.
TEST_P(DataWithoutMistake, IsSearched) {
  const CommandResult result =
      run_upright("identify " + std::string(GetParam().right) + " --plant " + source +
                  "/config/plants/viscous.yaml --data " + dataset(GetParam().wrong));
  EXPECT_NE(result.exit_code, 2) << result.err;
  EXPECT_NE(result.out, "");
}

INSTANTIATE_TEST_SUITE_P(Data, DataWithoutMistake,
                         ::testing::Values(Slip{"undone", "voltage_v: {column: voltage_v}", ""},
                                           Slip{"trusted", "voltage_v: {column: voltage_v, scale: -1}",
                                                "--trust-data"}),
                         [](const auto& slip) { return std::string(slip.param.name); });

}  // namespace
}  // namespace upright::testing
