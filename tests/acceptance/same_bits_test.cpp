// A log does not depend on the functions that libm picks for the processor: glibc is told that this one has
// neither AVX nor fused multiply-add, as another machine. That builds agree is for
// scripts/check-same-bits.sh.
#include <gtest/gtest.h>

#include "command.hpp"

namespace upright::testing {
namespace {

constexpr const char* as_on_an_older_processor =
    "GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA,-FMA4,-AVX ";

/// The simulated rig with sensor noise, and a plant of its own.
std::filesystem::path noisy_rig(const TemporaryFolder& folder, const std::string& plant) {
  const std::string config = std::string(UPRIGHT_SOURCE_DIR) + "/config";
  std::string text = read_text(config + "/rigs/simulated.yaml");
  const auto replace = [&](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  };
  replace("../plants/exponential.yaml", config + "/plants/" + plant + ".yaml");
  replace("noise: {cart_m: 0.0, theta_rad: 0.0}", "noise: {cart_m: 1.0e-5, theta_rad: 1.0e-3}");
  return folder.write("rig-" + plant + ".yaml", text);
}

CommandResult run(const std::string& environment, const std::string& arguments) {
  return run_shell(environment + shell_quoted(UPRIGHT_BINARY) + " " + arguments);
}

std::filesystem::path only_entry(const std::filesystem::path& folder) {
  return std::filesystem::directory_iterator(folder)->path();
}

class SameBits : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string here = run_shell(UPRIGHT_LIBM_BITS).out;
    if (here == run_shell(as_on_an_older_processor + std::string(UPRIGHT_LIBM_BITS)).out)
      GTEST_SKIP() << "NOT TESTED: libm has only one variant for this processor";
  }
};

TEST_F(SameBits, LogsDoNotDependOnLibm) {
  const TemporaryFolder folder;
  const std::string gains = std::string(UPRIGHT_SOURCE_DIR) + "/config/gains/";
  for (const std::string plant : {"exponential", "dynamic"})
    for (const std::string gain : {"exponential", "compensated", "quiet", "quiet-friction"}) {
      SCOPED_TRACE(gain + " on " + plant);
      const std::string common = "run --fast --duration 5 --theta0-deg 3 --seed 4 --rig " +
                                 shell_quoted(noisy_rig(folder, plant)) + " --gains " +
                                 shell_quoted(gains + gain + ".yaml");
      const auto here = folder.path() / (plant + gain + "-here"),
                 there = folder.path() / (plant + gain + "-there");
      ASSERT_EQ(run("", common + " --out " + shell_quoted(here)).exit_code, 0);
      ASSERT_EQ(run(as_on_an_older_processor, common + " --out " + shell_quoted(there)).exit_code, 0);
      const std::string rows = read_text(only_entry(here) / "samples.csv");
      EXPECT_GT(rows.size(), 100000u);
      EXPECT_TRUE(rows == read_text(only_entry(there) / "samples.csv"));
      EXPECT_EQ(run("", "replay " + shell_quoted(only_entry(there))).exit_code, 0);
    }
}

}  // namespace
}  // namespace upright::testing
