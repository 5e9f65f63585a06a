// `upright new`: what it writes is what `check` accepts. `upright schema`, of which it names the file.
#include <gtest/gtest.h>

#include "command.hpp"

namespace upright::testing {
namespace {

/// Runs `upright new ARGUMENTS` in a folder with these lines typed.
CommandResult write_new(const TemporaryFolder& folder, const std::string& arguments,
                        const std::string& typed = "") {
  return run_shell("cd " + shell_quoted(folder.path().string()) + " && printf -- " + shell_quoted(typed) +
                   " | " + shell_quoted(UPRIGHT_BINARY) + " new " + arguments);
}

CommandResult checked(const TemporaryFolder& folder, const std::string& files) {
  return run_shell("cd " + shell_quoted(folder.path().string()) + " && " + shell_quoted(UPRIGHT_BINARY) +
                   " check " + files);
}

std::string text_of(const TemporaryFolder& folder, const std::string& name) {
  return read_text(folder.path() / name);
}

TEST(New, WritesEveryKindWithItsDefaults) {
  const TemporaryFolder folder;
  for (const char* kind : {"plant", "gains", "rig", "experiment"}) {
    const CommandResult result = write_new(folder, kind);
    EXPECT_EQ(result.exit_code, 0) << kind << ": " << result.err;
    EXPECT_EQ(result.out, std::string(kind) + ".yaml\n");
    const std::string text = text_of(folder, std::string(kind) + ".yaml");
    EXPECT_NE(text.find("\n# "), std::string::npos) << kind << " has no comments";
    EXPECT_EQ(text.find('@'), std::string::npos) << kind << " has an answer that was not asked for:\n"
                                                 << text;
    EXPECT_EQ(text.find("#?"), std::string::npos) << text;
  }
  // They fit together, too.
  EXPECT_EQ(checked(folder, "plant.yaml gains.yaml rig.yaml").exit_code, 0);
  EXPECT_EQ(checked(folder, "experiment.yaml").exit_code, 0);
}

TEST(New, WritesARigOfEveryBackendThatItOffers) {
  const TemporaryFolder folder;
  ASSERT_EQ(write_new(folder, "plant").exit_code, 0);
  for (const std::string backend : {"simulated", "modbus-tcp", "modbus-rtu", "comedi", "quanser-hil"}) {
    const CommandResult result = write_new(folder, "rig --out " + backend + ".yaml", backend + "\\n");
    EXPECT_EQ(result.exit_code, 0) << backend << ": " << result.err;
    EXPECT_NE(result.err.find(backend), std::string::npos) << "the question names the backend";
    EXPECT_NE(text_of(folder, backend + ".yaml").find("backend: " + backend + "\n"), std::string::npos);
    EXPECT_EQ(checked(folder, backend + ".yaml").exit_code, 0) << backend;
  }
  const CommandResult unknown = write_new(folder, "rig --out other.yaml", "abacus\\n");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("no template for 'rig abacus'"), std::string::npos) << unknown.err;
}

TEST(New, NamesTheSchemaWhereItIsInstalled) {
  const TemporaryFolder folder;
  const std::filesystem::path program = folder.path() / "bin/upright",
                              schema = folder.path() / "share/upright/config/schema/gains.json";
  std::filesystem::create_directories(program.parent_path());
  std::filesystem::create_directories(schema.parent_path());
  std::filesystem::copy_file(UPRIGHT_BINARY, program);
  ASSERT_EQ(run_upright("schema gains --out " + schema.string()).exit_code, 0);
  const CommandResult result =
      run_shell("cd " + shell_quoted(folder.path().string()) + " && bin/upright new gains < /dev/null");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string line = "# yaml-language-server: $schema=" + schema.string() + "\n";
  EXPECT_EQ(text_of(folder, "gains.yaml").substr(0, line.size()), line);
  // No schema is installed for plants here.
  run_shell("cd " + shell_quoted(folder.path().string()) + " && bin/upright new plant < /dev/null");
  EXPECT_EQ(text_of(folder, "plant.yaml").find("$schema"), std::string::npos);
}

TEST(Schema, WritesWhatItPrints) {
  const TemporaryFolder folder;
  const CommandResult printed = run_upright("schema gains");
  EXPECT_EQ(printed.exit_code, 0) << printed.err;
  const std::filesystem::path file = folder.path() / "gains.json";
  EXPECT_EQ(run_upright("schema gains --out " + file.string()).exit_code, 0);
  EXPECT_EQ(read_text(file), printed.out);
  EXPECT_EQ(run_upright("schema gains --out /nowhere/gains.json").exit_code, 2);
  EXPECT_EQ(run_upright("schema colours").exit_code, 2);
}

TEST(New, TakesAnswersAndAsksAgainForWhatIsNone) {
  const TemporaryFolder folder;
  const CommandResult result = write_new(folder, "plant", "heavy\\n1.25\\n\\n0.4\\n");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("'heavy' is not a number"), std::string::npos) << result.err;
  const std::string text = text_of(folder, "plant.yaml");
  EXPECT_NE(text.find("cart_mass_kg: 1.25\n"), std::string::npos) << text;
  EXPECT_NE(text.find("mass_kg: 0.21, length_to_com_m: 0.4}"), std::string::npos) << text;
}

TEST(New, WritesNothingThatCheckWouldRefuse) {
  const TemporaryFolder folder;
  const CommandResult result = write_new(folder, "plant", "-1\\n");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("plant.yaml:4: plant.cart_mass_kg is -1"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("nothing was written"), std::string::npos) << result.err;
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(New, NamesTheFileThatHasToExistFirst) {
  const TemporaryFolder folder;
  const CommandResult result = write_new(folder, "experiment");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("there is no file plant.yaml"), std::string::npos) << result.err;
}

TEST(New, NamesFilesRelativeToTheNewOne) {
  const TemporaryFolder folder;
  ASSERT_EQ(write_new(folder, "plant").exit_code, 0);
  std::filesystem::create_directory(folder.path() / "rigs");
  ASSERT_EQ(write_new(folder, "rig --out rigs/mine.yaml").exit_code, 0);
  EXPECT_NE(text_of(folder, "rigs/mine.yaml").find("plant: \"../plant.yaml\"\n"), std::string::npos);
  EXPECT_EQ(checked(folder, "rigs/mine.yaml").exit_code, 0);
}

TEST(New, ReplacesAFileOnlyWhenAsked) {
  const TemporaryFolder folder;
  folder.write("gains.yaml", "mine\n");
  EXPECT_EQ(write_new(folder, "gains").exit_code, 2);
  EXPECT_EQ(text_of(folder, "gains.yaml"), "mine\n");
  EXPECT_EQ(write_new(folder, "gains --force").exit_code, 0);
  EXPECT_EQ(checked(folder, "gains.yaml").exit_code, 0);
}

}  // namespace
}  // namespace upright::testing
