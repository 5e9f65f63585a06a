// Flags that make no sense together or have no effect are errors; those that do have theirs.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
const std::string simulated = "run --rig " + config + "rigs/simulated.yaml --gains " + config +
                              "gains/exponential.yaml --duration 0.2 ";

std::string out(const TemporaryFolder& folder) {
  return " --out " + (folder.path() / "runs").string();
}

TEST(Flags, ThatCannotHaveAnEffectAreErrors) {
  for (const std::string& flags :
       {std::string("--fast --seed -1"), std::string("--fast --seed=-1"), std::string("--fast --seed 1.5"),
        std::string("--fast --seed 18446744073709551616"), std::string("--fast --wait 5"),
        std::string("--wait 5"), "--fast --plant " + config + "plants/viscous.yaml"}) {
    const TemporaryFolder folder;
    const CommandResult result = run_upright(simulated + flags + out(folder));
    EXPECT_EQ(result.exit_code, 2) << flags << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(folder.path() / "runs")) << flags;
  }
  const TemporaryFolder folder;
  EXPECT_EQ(run_upright(simulated + "--fast --seed 18446744073709551615" + out(folder)).exit_code, 0);
}

TEST(Flags, LiveTakesItsPortAsTheNextWord) {
  for (const std::string& flag : {std::string("--live 0"), std::string("--live=0")}) {
    const TemporaryFolder folder;
    const CommandResult result = run_upright(simulated + flag + out(folder));
    EXPECT_NE(result.out.find("Live view: http://"), std::string::npos) << flag << result.err;
  }
  const TemporaryFolder folder;
  EXPECT_EQ(run_upright(simulated + "--live 99999" + out(folder)).exit_code, 2);
}

TEST(DesignOut, SaysWhatItWroteAndKeepsTheWeights) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "gains.yaml";
  const CommandResult result = run_upright(
      "design " + config + "plants/exponential.yaml --q 4000,3000,20,25 --r 2 --out " + file.string());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("written to " + file.string()), std::string::npos) << result.out;
  const std::string text = read_text(file);
  EXPECT_NE(text.find("--q 4000.0,3000.0,20.0,25.0 --r 2.0"), std::string::npos) << text;
  EXPECT_EQ(run_upright("check " + file.string()).exit_code, 0);
}

TEST(DesignOut, LeavesNoHalfFileOnAFullDisk) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("gains.yaml", "mine\n");
  // A limit on the size of files is a disk that is full.
  const CommandResult result =
      run_shell("ulimit -f 0; trap '' XFSZ; " + shell_quoted(UPRIGHT_BINARY) + " design " + config +
                "plants/exponential.yaml --force --out " + file.string() + " >/dev/null");
  EXPECT_NE(result.exit_code, 0);
  EXPECT_EQ(read_text(file), "mine\n");
  EXPECT_FALSE(fs::exists(file.string() + ".partial"));
}

}  // namespace
}  // namespace upright::testing
