// Files that come from somebody else: pages show what they say and never do it, and what would eat the
// machine is refused at once. docs/explanation/security.md says what each of these is about.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <sstream>

#include "command.hpp"

namespace upright::testing {
namespace {

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
/// Without a slash it is a folder's name too.
const std::string hostile = "<script>alert(\"1\")&'`date`$(date)<img src=x onerror=alert(1)>";
/// The same where a quote would end the text around it.
const std::string in_yaml = "'<script>alert(\"1\")&''`date`$(date)<img src=x onerror=alert(1)>'";
const std::string in_json = R"(<script>alert(\"1\")&'`date`$(date)<img src=x onerror=alert(1)>)";

/// A folder with the hostile name.
std::filesystem::path hostile_folder(const TemporaryFolder& folder) {
  const std::filesystem::path path = folder.path() / hostile;
  std::filesystem::create_directories(path);
  return path;
}

std::string with_line(std::string yaml, const std::string& key, const std::string& value) {
  const std::size_t at = yaml.find(key + ": ");
  if (at == std::string::npos) throw std::runtime_error("no " + key);
  return yaml.replace(at, yaml.find('\n', at) - at, key + ": " + value);
}

/// What was shown of it is there as text, `times` at least, and nothing of it is markup.
void expect_only_text(const std::filesystem::path& folder, std::size_t times) {
  const CommandResult result = run_upright("report " + shell_quoted(folder.string()));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string html = read_text(folder / "report.html");
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_EQ(html.find("<img"), std::string::npos);
  EXPECT_EQ(html.find("alert(\"1"), std::string::npos) << "a quote as it was";
  std::size_t shown = 0;
  for (std::size_t at = 0; (at = html.find("script&gt;alert(", at)) != std::string::npos; ++at) ++shown;
  EXPECT_GE(shown, times);
  EXPECT_NE(html.find("Content-Security-Policy"), std::string::npos);
}

/// A run made into a folder with the hostile name.
std::filesystem::path fast_run(const TemporaryFolder& folder) {
  const CommandResult result =
      run_upright("run --fast --duration 1 --rig " + shell_quoted(config + "rigs/simulated.yaml") +
                  " --gains " + shell_quoted(config + "gains/exponential.yaml") + " --out " +
                  shell_quoted((folder.path() / "runs" / hostile).string()));
  if (result.exit_code != 0) throw std::runtime_error(result.err);
  return std::filesystem::directory_iterator(folder.path() / "runs" / hostile)->path();
}

TEST(HostileRun, IsShownAsText) {
  const TemporaryFolder folder;
  const std::filesystem::path made = fast_run(folder);
  expect_only_text(made, 2);  // its own command line, in run.yaml and beside it
  const std::filesystem::path run = folder.path() / hostile;
  std::filesystem::rename(made, run);
  std::string yaml = read_text(run / "run.yaml");
  for (const char* key : {"label", "command", "started_utc", "host", "kernel", "sentence", "note", "version"})
    yaml = with_line(yaml, key, in_yaml);
  std::ofstream(run / "run.yaml") << yaml;
  expect_only_text(run, 8);
}

TEST(HostileDiagnosis, IsShownAsText) {
  const TemporaryFolder folder;
  const std::filesystem::path diagnosis = hostile_folder(folder);
  std::string json = R"({"verdict": "unexplained", "residual": "HERE", "gap": {"before": 2, "after": 1},
    "effects": [{"kind": "HERE", "gap_before": 2, "gap_after": 1, "where": "HERE", "confusable_with": ["HERE"],
                 "parameters": {"HERE": {"value": 1, "ci95": [0, 2], "unit": "HERE"}}}],
    "candidates": [{"kind": "HERE", "evidence": 1, "gap_after": 1}],
    "next_experiment": {"name": "HERE", "description": "HERE"}, "notes": ["HERE"]})";
  for (std::size_t at; (at = json.find("HERE")) != std::string::npos;) json.replace(at, 4, in_json);
  std::ofstream(diagnosis / "diagnosis.json") << json;
  std::ofstream(diagnosis / "traces.csv")
      << "a,b\n0," << hostile << ",0,0,1,2,3,4,5,6\n0," << hostile << ",1,0,1,2,3,4,5,6\n";
  std::ofstream(diagnosis / "model.yaml") << "plant: " << in_yaml << "\n";
  std::ofstream(diagnosis / "given.yaml") << "plant: " << in_yaml << "\n";
  expect_only_text(diagnosis, 12);
}

TEST(HostileDiagnosis, IsRefusedWhereItIsNone) {
  const TemporaryFolder folder;
  for (const std::string& text : {std::string("{"), std::string("[]"), R"({"verdict": ")" + in_json + R"("})",
                                  std::string(100'000, '[')}) {
    folder.write("d/diagnosis.json", text);
    const CommandResult result = run_upright("report " + shell_quoted((folder.path() / "d").string()));
    EXPECT_EQ(result.exit_code, 2) << text.substr(0, 80) << "\n" << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "d/report.html"));
  }
}

TEST(HostileSweep, IsShownAsText) {
  const TemporaryFolder folder;
  const std::filesystem::path sweep = hostile_folder(folder);
  std::ofstream(sweep / "sweep.csv")
      << "theta0_rad,delay_s,outcome,theta_amplitude_rad,cart_amplitude_m,fall_time_s\n"
         "0.01,0.001,stable,0,0,nan\n0.01,0.002,oscillating,0.1,0.1,nan\n0.02,0.001,stable,0,0,nan\n"
         "0.02,0.002,fell,1,1,2\n";
  std::ofstream(sweep / "transitions.csv") << "theta0_rad,oscillates_from_s,falls_from_s\n0.01,0.0015,nan\n";
  std::ofstream(sweep / "margins.csv") << "model,critical_delay_s,crossing_radps\n"
                                       << hostile << ",0.0012,3\n";
  std::ofstream(sweep / "sweep.yaml") << "sweep: " << in_yaml << "\n";
  expect_only_text(sweep, 2);
  EXPECT_NE(read_text(sweep / "report.html").find("linear, &#x3c;script&#x3e;"), std::string::npos)
      << "the label of a line in a plot";
}

TEST(HostileSweep, IsRefusedWithAHeaderOfItsOwn) {
  const TemporaryFolder folder;
  folder.write("s/sweep.csv", "theta0_rad," + hostile + "\n");
  const CommandResult result = run_upright("report " + shell_quoted((folder.path() / "s").string()));
  EXPECT_EQ(result.exit_code, 2) << result.err;
}

TEST(HostileExperiment, IsShownAsText) {
  const TemporaryFolder folder;
  const std::filesystem::path experiment = hostile_folder(folder);
  std::ofstream(experiment / "experiment.yaml")
      << "name: " << in_yaml << "\npieces:\n  - {kind: observe, duration_s: 1}\n";
  std::ofstream(experiment / "trials.csv")
      << "piece,label,repeat,delay_s,run_directory,reason,outcome,theta0_rad,theta_amplitude_rad,cart_"
         "amplitude_m,"
         "fall_time_s,frequency_hz\n0,"
      << hostile << ",0,0.01," << hostile << ",duration," << hostile << ",0.1,0.1,0.1,nan,1\n";
  expect_only_text(experiment, 3);
}

/// A report is a new file: what stands in its place in a folder from somebody else is not written through.
TEST(Report, IsNotWrittenThroughALink) {
  const TemporaryFolder folder;
  const std::filesystem::path run = fast_run(folder), mine = folder.write("mine", "keep this");
  for (const char* name : {"report.html", "report.html.part"})
    std::filesystem::create_symlink(mine, run / name);
  EXPECT_EQ(run_upright("report " + shell_quoted(run.string())).exit_code, 0);
  EXPECT_EQ(read_text(mine), "keep this");
  EXPECT_FALSE(std::filesystem::is_symlink(run / "report.html"));
}

/// The file is refused in one sentence with its place, in a time in which nothing was built of it.
void expect_refused_at_once(const TemporaryFolder& folder, const std::string& name, const std::string& text,
                            const std::string& why) {
  const std::filesystem::path file = folder.write(name, text);
  const auto started = std::chrono::steady_clock::now();
  // A gigabyte is little for what these would make of it.
  const CommandResult result = run_shell("ulimit -v 1000000; " + shell_quoted(UPRIGHT_BINARY) + " check " +
                                         shell_quoted(file.string()));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started;
  EXPECT_EQ(result.exit_code, 2) << name << "\n" << result.err;
  EXPECT_NE(result.err.find(why), std::string::npos) << name << "\n" << result.err;
  EXPECT_NE(result.err.find(file.string()), std::string::npos) << result.err;
  EXPECT_LT(took.count(), 10.0) << name;
}

TEST(HostileYaml, IsRefusedAtOnce) {
  const TemporaryFolder folder;
  std::string laughs = "a: &a [lol, lol, lol, lol, lol, lol, lol, lol, lol]\n";
  for (char c = 'b'; c <= 'j'; ++c) {
    laughs += std::string(1, c) + ": &" + c + " [";
    for (int i = 0; i < 9; ++i) laughs += std::string(i == 0 ? "*" : ", *") + static_cast<char>(c - 1);
    laughs += "]\n";
  }
  expect_refused_at_once(folder, "laughs.yaml", laughs, "aliases are not supported");
  expect_refused_at_once(folder, "itself.yaml", "plant: &p {effects: [*p]}\n", "aliases are not supported");
  expect_refused_at_once(folder, "deep.yaml", "plant: " + std::string(100'000, '['), "nest less deeply");
  expect_refused_at_once(folder, "deep-map.yaml", "plant: " + std::string(100'000, '{'), "nest less deeply");
  expect_refused_at_once(folder, "large.yaml", "# " + std::string((16 << 20) + 1, 'x'), "larger than 16 MiB");
  expect_refused_at_once(folder, "several.yaml", "plant: {}\n---\nplant: {}\n",
                         "a second document begins here");
}

/// Nobody else may change what a run left behind, and a umask that keeps others from reading is kept to.
TEST(RunDirectory, FollowsTheUmaskAndHasNoWriterButItsOwner) {
  const TemporaryFolder folder;
  const auto mode_of = [](const std::filesystem::path& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) throw std::runtime_error("cannot stat " + path.string());
    return status.st_mode & 0777u;
  };
  for (const auto& [mask, folder_mode, file_mode] :
       {std::tuple{"022", 0755u, 0644u}, {"077", 0700u, 0600u}}) {
    const std::string out = (folder.path() / mask).string();
    const CommandResult result = run_shell(
        std::string("umask ") + mask + "; " + shell_quoted(UPRIGHT_BINARY) +
        " run --fast --duration 0.1 --rig " + shell_quoted(config + "rigs/simulated.yaml") + " --gains " +
        shell_quoted(config + "gains/exponential.yaml") + " --out " + shell_quoted(out));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const std::filesystem::path run = std::filesystem::directory_iterator(out)->path();
    EXPECT_EQ(mode_of(run), folder_mode);
    for (const char* file : {"run.yaml", "samples.csv"}) EXPECT_EQ(mode_of(run / file), file_mode) << file;
  }
}

TEST(VirtualRig, ListensOnThisMachineOnlyUnlessTold) {
  const std::string command =
      "virtual-rig --duration 0.2 --rig " + shell_quoted(config + "rigs/modbus-tcp.yaml") + " --tcp ";
  for (const char* address : {"0", ":0", "localhost:0", "127.0.0.1:0"}) {
    const CommandResult result = run_upright(command + address);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out.rfind("listening on 127.0.0.1:", 0), 0u) << result.out;
    EXPECT_EQ(result.err, "");
  }
  const CommandResult everybody = run_upright(command + "0.0.0.0:0");
  EXPECT_EQ(everybody.exit_code, 0);
  EXPECT_NE(everybody.err.find("every machine that reaches 0.0.0.0:"), std::string::npos) << everybody.err;
}

}  // namespace
}  // namespace upright::testing
