// The command line as a user meets it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

using Json = nlohmann::json;

void expect_one_sentence(const CommandResult& result, const std::string& part) {
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
}

TEST(CommandLine, UnknownWordsAreAnsweredWithTheNearestKnownOne) {
  expect_one_sentence(run_upright("efects"), "did you mean effects?");
  expect_one_sentence(run_upright("effects --jsn"), "did you mean --json?");
  expect_one_sentence(run_upright("effects --jsn=3"), "did you mean --json?");
  expect_one_sentence(run_upright("zzzzzzzz"), "no command zzzzzzzz");
  expect_one_sentence(run_upright("effects more"), "'more'");
  expect_one_sentence(run_upright(""), "no command was given: choose one");
  expect_one_sentence(run_upright("check"), "files is required");
}

TEST(CommandLine, NumbersMustBeFiniteAndFit) {
  const std::string config = UPRIGHT_SOURCE_DIR "/config/";
  const std::string rig = "virtual-rig --rig " + config + "rigs/modbus-tcp.yaml --tcp 127.0.0.1:0 ";
  const std::string run =
      "run --rig " + config + "rigs/simulated.yaml --gains " + config + "gains/viscous.yaml --fast ";
  expect_one_sentence(run_upright(rig + "--theta0-deg nan"),
                      "--theta0-deg: must be a finite number, but is nan");
  expect_one_sentence(run_upright(rig + "--hang nan"), "--hang: must be a finite number, but is nan");
  expect_one_sentence(run_upright(rig + "--duration inf"), "--duration: must be a finite number, but is inf");
  expect_one_sentence(run_upright(rig + "--inject-late-ms nan"),
                      "--inject-late-ms: must be a finite number, but is nan");
  expect_one_sentence(run_upright(rig + "--inject-seed 18446744073709551616"),
                      "--inject-seed: must be a whole number from 0 to");
  expect_one_sentence(run_upright(run + "--cpu 1023"),
                      "--cpu: this process is not allowed to run on processor 1023");
  expect_one_sentence(run_upright(run + "--seed 18446744073709551616"),
                      "--seed: must be a whole number from 0 to");
  expect_one_sentence(run_upright("design " + config + "plants/viscous.yaml --q 5000,nan,20,20 --r 1"),
                      "must be a finite number, but is nan");
}

TEST(CommandLine, HelpShowsAnExampleForEveryCommand) {
  const CommandResult help = run_upright("--help");
  EXPECT_EQ(help.exit_code, 0);
  std::istringstream lines(help.out.substr(help.out.find("Subcommands:")));
  std::string line;
  std::getline(lines, line);
  int commands = 0;
  while (std::getline(lines, line) && !line.empty()) {
    if (line.substr(0, 3) == "   ") continue;  // a description's second line
    const std::string name = line.substr(2, line.find(' ', 2) - 2);
    const CommandResult own = run_upright(name + " --help");
    EXPECT_EQ(own.exit_code, 0) << name;
    EXPECT_NE(own.out.find("upright " + name), own.out.rfind("upright " + name)) << name << " has no example";
    ++commands;
  }
  EXPECT_GE(commands, 2);
}

TEST(CommandLine, EffectsListsTheRegistryAsOneJsonDocument) {
  const CommandResult result = run_upright("effects --json");
  EXPECT_EQ(result.exit_code, 0);
  const Json effects = Json::parse(result.out).at("effects");
  const CommandResult text = run_upright("effects");
  EXPECT_GE(effects.size(), 27u);
  for (const Json& effect : effects) {
    const std::string kind = effect.at("kind");
    EXPECT_NE(text.out.find(kind + "  ("), std::string::npos) << kind;
    for (const char* key : {"enters", "equation", "meaning"}) EXPECT_NE(effect.at(key), "") << kind;
    EXPECT_FALSE(effect.at("parameters").empty()) << kind;
    for (const Json& parameter : effect.at("parameters"))
      EXPECT_NE(text.out.find(parameter.at("name").get<std::string>()), std::string::npos);
  }
}

TEST(CommandLine, EffectsOfOneKindListsThatOneAlone) {
  const Json effects = Json::parse(run_upright("effects coulomb_friction --json").out).at("effects");
  ASSERT_EQ(effects.size(), 1u);
  EXPECT_EQ(effects.at(0).at("kind"), "coulomb_friction");
  expect_one_sentence(run_upright("effects coulomb_frictoin"), "did you mean coulomb_friction?");
}

TEST(CommandLine, CheckReportsEveryFileAndFailsWhenOneIsBad) {
  const TemporaryFolder folder;
  const std::string good = UPRIGHT_SOURCE_DIR "/config/plants/viscous.yaml";
  const std::string bad = folder.write("bad.yaml", "plant: 3\n");
  EXPECT_EQ(run_upright("check " + good).exit_code, 0);
  const CommandResult result = run_upright("check --json " + bad + " " + good);
  EXPECT_EQ(result.exit_code, 2);
  const Json document = Json::parse(result.out);
  EXPECT_EQ(document.at("valid"), false);
  EXPECT_EQ(document.at("files").at(0).at("valid"), false);
  EXPECT_EQ(document.at("files").at(1).at("valid"), true);
  EXPECT_EQ(document.at("files").at(1).at("kind"), "plant");
  EXPECT_NE(result.err.find(bad), std::string::npos);
}

TEST(CommandLine, EveryFileOfTheRepositoryIsValid) {
  const CommandResult result =
      run_shell("find " UPRIGHT_SOURCE_DIR "/config -name '*.yaml' -print0 | xargs -0 " +
                shell_quoted(UPRIGHT_BINARY) + " check");
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST(CommandLine, ACardThatIsNotThereIsADeviceErrorWithItsRemedy) {
  const TemporaryFolder folder;
  const std::string rig = read_text(UPRIGHT_SOURCE_DIR "/config/rigs/comedi-multiq3.yaml");
  const std::string device = "/dev/comedi0";
  const std::string nowhere = (folder.path() / "card").string();
  const auto file =
      folder.write("rig.yaml", std::string(rig).replace(rig.find(device), device.size(), nowhere));
  const CommandResult result =
      run_upright("run --unchecked --rig " + shell_quoted(file.string()) + " --gains " +
                  shell_quoted(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml") + " --out " +
                  shell_quoted(folder.path() / "runs"));
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_NE(result.err.find("load the card's driver"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find(nowhere), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "runs")) << "nothing ran";
}

TEST(CommandLine, AMissingQuanserLibraryIsADeviceErrorWithRemedy) {
  const TemporaryFolder folder;
  const CommandResult result = run_upright(
      "run --unchecked --rig " + shell_quoted(UPRIGHT_SOURCE_DIR "/config/rigs/quanser-q2-usb.yaml") +
      " --gains " + shell_quoted(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml") + " --out " +
      shell_quoted(folder.path() / "runs"));
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_NE(result.err.find("libhil.so"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("install Quanser's SDK"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "runs")) << "nothing ran";
}

TEST(CommandLine, TheVirtualRigServesModbusOnly) {
  for (const char* rig : {"comedi-multiq3.yaml", "comedi-and-modbus.yaml", "quanser-q2-usb.yaml"}) {
    const CommandResult result =
        run_upright(std::string("virtual-rig --tcp 127.0.0.1:0 --rig ") +
                    shell_quoted(UPRIGHT_SOURCE_DIR "/config/rigs/") + rig + " --plant " +
                    shell_quoted(UPRIGHT_SOURCE_DIR "/config/plants/viscous.yaml"));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("use a rig file whose only backend is modbus-tcp or modbus-rtu"),
              std::string::npos)
        << result.err;
  }
}

TEST(CommandLine, AFullDiskUnderTheOutputIsAnError) {
  const CommandResult result = run_upright("effects >/dev/full");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_NE(result.err.find("standard output"), std::string::npos);
}

}  // namespace
}  // namespace upright::testing
