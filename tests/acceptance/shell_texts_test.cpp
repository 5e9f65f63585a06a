// What shells and manuals have from the program: completion and manual pages.
#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "command.hpp"

namespace upright::testing {
namespace {

const std::string source = UPRIGHT_SOURCE_DIR;

/// What a shell offers for the last word, without the meanings.
std::set<std::string> offered(const std::string& words) {
  const CommandResult result = run_shell("cd " + shell_quoted(source) + " && " +
                                         shell_quoted(UPRIGHT_BINARY) + " __complete " + words);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::set<std::string> found;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) found.insert(line.substr(0, line.find('\t')));
  return found;
}

using Words = std::set<std::string>;

TEST(Completion, OffersCommandsAndTheirOptions) {
  EXPECT_EQ(offered("diag"), Words{"diagnose"});
  EXPECT_EQ(offered("run --g"), Words{"--gains"});
  EXPECT_TRUE(offered("''").contains("virtual-rig"));
  EXPECT_TRUE(offered("--").contains("--version"));
  EXPECT_EQ(offered("no-such-command ''"), Words{});
  EXPECT_EQ(offered(""), Words{});
}

TEST(Completion, OffersFilesOfTheKindThatTheOptionTakes) {
  EXPECT_EQ(offered("run --rig config/rigs/s"), Words{"config/rigs/simulated.yaml"});
  EXPECT_EQ(offered("run --rig config/gains/"), Words{}) << "a gain file is no rig";
  EXPECT_EQ(offered("run --rig x.yaml --gains config/gains/quiet-"),
            Words{"config/gains/quiet-friction.yaml"});
  EXPECT_EQ(offered("run --rig conf"), Words{"config/"});
  EXPECT_EQ(offered("margin config/plants/viscous.yaml config/gains/vis"),
            Words{"config/gains/viscous.yaml"});
  EXPECT_EQ(offered("margin --smoothing 3 config/plants/vis"), Words{"config/plants/viscous.yaml"});
  EXPECT_EQ(offered("experiment config/experiments/pi"), Words{"config/experiments/pivot.yaml"});
  EXPECT_EQ(offered("experiment config/gains/"), Words{});
  EXPECT_EQ(offered("check config/ri"), Words{}) << "any kind of file: left to the shell";
}

TEST(Completion, OffersWordsAndEffects) {
  EXPECT_EQ(offered("design p.yaml --estimator ''"), (Words{"none", "kalman", "extended_kalman"}));
  EXPECT_EQ(offered("effects coulomb"), Words{"coulomb_friction"});
  EXPECT_EQ(offered("completion z"), Words{"zsh"});
}

TEST(Completion, BashAsksTheProgram) {
  const CommandResult script = run_upright("completion bash");
  ASSERT_EQ(script.exit_code, 0);
  const TemporaryFolder folder;
  const std::string file = folder.write("completion.bash", script.out);
  const CommandResult result = run_shell(
      "cd " + shell_quoted(source) + " && bash -c 'source " + file + "; COMP_WORDS=(" + UPRIGHT_BINARY +
      " run --rig config/rigs/bo); COMP_CWORD=3; _upright; echo \"${COMPREPLY[@]}\"'");
  EXPECT_EQ(result.out, "config/rigs/board.yaml\n") << result.err;
}

TEST(Completion, RefusesAShellThatItDoesNotKnow) {
  const CommandResult result = run_upright("completion tcsh");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("bash,zsh,fish"), std::string::npos) << result.err;
}

TEST(Manual, HasAPageForEachCommandWithItsOptions) {
  const TemporaryFolder folder;
  const std::string out = (folder.path() / "man1").string();
  ASSERT_EQ(run_upright("manual --out " + out).exit_code, 0);
  const std::string program = read_text(out + "/upright.1");
  for (const std::string& name : offered("''")) {
    const std::string page = read_text(out + "/upright-" + name + ".1");
    EXPECT_EQ(page.find(".TH upright-" + name + " 1 "), page.find(".TH ")) << name;
    const std::size_t hyphen = name.find('-');
    const std::string shown =
        hyphen == std::string::npos ? name : std::string(name).replace(hyphen, 1, "\\-");
    EXPECT_NE(program.find("\\fBupright\\-" + shown + "\\fR(1)"), std::string::npos) << name;
  }
  const std::string run = read_text(out + "/upright-run.1");
  EXPECT_NE(run.find("\\fB\\-\\-theta0\\-deg\\fR \\fIFLOAT\\fR"), std::string::npos);
  EXPECT_NE(run.find("\\fB\\-\\-rig\\fR \\fITEXT\\fR (required)"), std::string::npos);
}

TEST(Manual, SaysWhereItCannotBeWritten) {
  const CommandResult result = run_upright("manual --out /proc/nowhere");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("cannot write /proc/nowhere/upright.1"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace upright::testing
