// `upright report` on whole runs and on what is left of killed ones.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <sstream>
#include <thread>

#include "command.hpp"

namespace upright::testing {
namespace {

const std::string run_flags =
    "--rig " UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml --gains " UPRIGHT_SOURCE_DIR
    "/config/gains/exponential.yaml --theta0-deg 3 ";

/// Runs in virtual time and returns the run directory.
std::filesystem::path fast_run(const TemporaryFolder& folder, const std::string& more) {
  const CommandResult result =
      run_upright("run --fast " + run_flags + more + " --out " + shell_quoted(folder.path().string()));
  std::istringstream lines(result.out);
  std::string last;
  for (std::string line; std::getline(lines, line);) last = line;
  return last;
}

std::string report_of(const std::filesystem::path& run) {
  const CommandResult result = run_upright("report " + shell_quoted(run.string()));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, (run / "report.html").string() + "\n");
  return read_text(run / "report.html");
}

void expect_stands_alone(const std::string& html) {
  for (const char* elsewhere : {"http:", "https:", "//", "src=", "@import", "<script", "<link", "<img"})
    EXPECT_EQ(html.find(elsewhere), std::string::npos) << elsewhere << " in the page";
  EXPECT_EQ(html.rfind("</html>\n"), html.size() - 8);
}

TEST(Report, OfAWholeRunAnswersFirstAndStandsAlone) {
  const TemporaryFolder folder;
  const std::string html = report_of(fast_run(folder, "--duration 10"));
  const std::size_t answer = html.find("Stayed upright for 10 s");
  ASSERT_NE(answer, std::string::npos);
  for (const char* part : {"pendulum angle", "cart position", "voltage", "Timing", "run.yaml", "sample rate"})
    EXPECT_GT(html.find(part, answer), answer) << part;
  expect_stands_alone(html);
}

TEST(Report, OfAFallSaysSo) {
  const TemporaryFolder folder;
  const std::string html = report_of(fast_run(folder, "--duration 10 --delay 0.4"));
  EXPECT_EQ(html.find("Stayed up"), std::string::npos);
  EXPECT_NE(html.find("class=\"answer bad\""), std::string::npos);
}

TEST(Report, OfATornLogShowsTheWholeRows) {
  const TemporaryFolder folder;
  const std::filesystem::path run = fast_run(folder, "--duration 3");
  const std::string rows = read_text(run / "samples.csv");
  std::filesystem::resize_file(run / "samples.csv", rows.size() / 2 + 7);
  const std::string html = report_of(run);
  EXPECT_NE(html.find("The last line of samples.csv is incomplete"), std::string::npos);
  std::filesystem::resize_file(run / "samples.csv", rows.find('\n') + 1);
  EXPECT_NE(report_of(run).find("The log contains no rows."), std::string::npos);
}

TEST(Report, NeverTurnsWhatARunSaysIntoMarkup) {
  const TemporaryFolder folder;
  const std::filesystem::path run = fast_run(folder, "--duration 1");
  std::string yaml = read_text(run / "run.yaml");
  const std::size_t at = yaml.find("command: ");
  yaml.replace(at, yaml.find('\n', at) - at, "command: '<script>alert(\"1\")</script>'");
  folder.write(std::filesystem::relative(run / "run.yaml", folder.path()).string(), yaml);
  const std::string html = report_of(run);
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_NE(html.find("&lt;script&gt;"), std::string::npos);
}

TEST(Report, OfAKilledRunStillWorks) {
  const TemporaryFolder folder;
  const CommandResult killed = run_shell(shell_quoted(UPRIGHT_BINARY) + " run --fast " + run_flags +
                                         "--duration 86400 --out " + shell_quoted(folder.path().string()) +
                                         " >/dev/null 2>&1 & child=$!; sleep 1; kill -9 $child; wait $child");
  EXPECT_EQ(killed.exit_code, 128 + SIGKILL);
  const std::filesystem::path run = std::filesystem::directory_iterator(folder.path())->path();
  const std::string html = report_of(run);
  EXPECT_NE(html.find("Cut short after"), std::string::npos);
}

TEST(Report, RefusesWhatIsNotARunWithOneSentence) {
  const TemporaryFolder folder;
  for (const std::string& path : {folder.path().string(), (folder.path() / "none").string(),
                                  folder.write("broken/run.yaml", "a: [1").parent_path().string(),
                                  folder.write("empty/run.yaml", "").parent_path().string()}) {
    const CommandResult result = run_upright("report " + shell_quoted(path));
    EXPECT_EQ(result.exit_code, 2) << path;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(path), std::string::npos) << result.err;
  }
}

TEST(Report, TakesSeveralRunsAndPrintsALineForEach) {
  const TemporaryFolder folder;
  const std::filesystem::path first = fast_run(folder, "--duration 1"),
                              second = fast_run(folder, "--duration 1");
  const CommandResult both = run_upright("report " + shell_quoted(folder.path().string()) + "/*-run*");
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_EQ(both.out, (first / "report.html").string() + "\n" + (second / "report.html").string() + "\n");
  // What is no run costs the others nothing, and is said.
  std::filesystem::remove(second / "report.html");
  const CommandResult mixed =
      run_upright("report " + (folder.path() / "none").string() + " " + second.string());
  EXPECT_EQ(mixed.exit_code, 2);
  EXPECT_EQ(mixed.out, (second / "report.html").string() + "\n");
  EXPECT_NE(mixed.err.find((folder.path() / "none").string() + " does not exist"), std::string::npos)
      << mixed.err;
}

TEST(Report, LatestIsTheRunThatBeganLast) {
  const TemporaryFolder folder;
  const std::string latest = "report --latest --out " + shell_quoted(folder.path().string());
  const CommandResult nothing = run_upright(latest);
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_NE(nothing.err.find("contains no run"), std::string::npos) << nothing.err;
  const std::filesystem::path old = fast_run(folder, "--duration 1 --label zz");
  const std::filesystem::path newer = fast_run(folder, "--duration 1 --label aa");
  EXPECT_EQ(run_upright(latest).out, (newer / "report.html").string() + "\n");
  // The name tells when it began, also of a run that was copied later.
  std::filesystem::rename(newer, folder.path() / "20200101T000000Z-aa");
  EXPECT_EQ(run_upright(latest).out, (old / "report.html").string() + "\n");
}

TEST(Report, WithoutGnuplotNamesTheRemedy) {
  const TemporaryFolder folder;
  const std::filesystem::path run = fast_run(folder, "--duration 1");
  const CommandResult result =
      run_shell("PATH=" + shell_quoted(folder.path().string()) + "; " + shell_quoted(UPRIGHT_BINARY) +
                " report " + shell_quoted(run.string()));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("install gnuplot"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace upright::testing
