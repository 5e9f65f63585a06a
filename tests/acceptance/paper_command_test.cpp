// `upright paper`: the document that scripts/reproduce-paper.sh writes, and that its figures are pictures.
#include <gtest/gtest.h>

#include "command.hpp"

namespace upright::testing {
namespace {

TEST(Paper, WritesEveryTableAndFigureAndDoesNotOverwrite) {
  const TemporaryFolder folder;
  const CommandResult result = run_shell("UPRIGHT=" + shell_quoted(UPRIGHT_BINARY) + " " +
                                         shell_quoted(UPRIGHT_SOURCE_DIR "/scripts/reproduce-paper.sh") +
                                         " " + shell_quoted(folder.path().string()));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string text = read_text(folder.path() / "paper.md");
  for (const char* wanted :
       {"| 70.71068 | 304.927 |", "| 170.1701 | 290.4994 |", "| 0.10690 | 10.23 |", "| 0.11598 | 9.6333 |",
        "| 0.10724 |", "| 0.01536 |", "0 of 100", "fell at", "| quiet | exponential |", "| quiet | dynamic |",
        "| quiet with friction | dynamic |"})
    EXPECT_NE(text.find(wanted), std::string::npos) << wanted << "\n" << text;
  EXPECT_EQ(text.find("nan"), std::string::npos);
  for (const char* figure :
       {"2-angle", "2-cart", "3", "4-angle", "4-cart", "5", "6-angle", "6-cart", "7", "8", "9", "10", "11"}) {
    const std::string name = "paper/figure-" + std::string(figure) + ".svg";
    EXPECT_NE(text.find(name), std::string::npos) << name;
    // Without the name space a browser takes the file for text.
    EXPECT_EQ(read_text(folder.path() / name).find("<svg xmlns=\"http://www.w3.org/2000/svg\""), 0u) << name;
  }
  const CommandResult again = run_upright("paper --config " + shell_quoted(UPRIGHT_SOURCE_DIR "/config") +
                                          " --out " + shell_quoted(folder.path().string()));
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("--overwrite"), std::string::npos) << again.err;
}

}  // namespace
}  // namespace upright::testing
