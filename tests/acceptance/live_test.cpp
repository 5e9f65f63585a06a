// `--live` as a teacher uses it: the page in a real browser, its drawing that moves, its stop button; and the
// same over plain HTTP. Pictures of the page stay in the test's run folder.
#include <gtest/gtest.h>
#include <httplib.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <thread>

#include "../integration/virtual_rig_process.hpp"
#include "base/palette.hpp"
#include "browser.hpp"
#include "command.hpp"
#include "tests/support/run_end.hpp"

namespace upright::testing {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Process;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
const std::string rig = config + "rigs/simulated.yaml";
const std::string gains = config + "gains/exponential.yaml";

/// The page's address, from the line that says it.
int port_said_by(Process& program) {
  for (int lines = 0; lines < 10; ++lines) {
    std::smatch found;
    const std::string line = program.line();
    if (std::regex_search(line, found, std::regex("^Live view: http://127\\.0\\.0\\.1:([0-9]+)/$")))
      return std::stoi(found[1]);
  }
  throw std::runtime_error("the program said no address");
}

/// With a delay of 14 ms the loop keeps swinging by a few degrees: something to look at. At 200 Hz, since the
/// limit for late periods is the tightest there, and the machine is not alone.
std::vector<std::string> run_command(const fs::path& out) {
  return {
      UPRIGHT_BINARY, "run",   "--rig",     rig,     "--gains",    config + "gains/exponential-200hz.yaml",
      "--theta0-deg", "3",     "--delay",   "0.014", "--duration", "120",
      "--live=0",     "--out", out.string()};
}

fs::path only_run_in(const fs::path& folder) {
  const fs::directory_iterator first(folder);
  return first->path();
}

void stop_over_http() {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "runs";
  Process program(run_command(out));
  httplib::Client page("127.0.0.1", port_said_by(program));
  const std::string text = page.Get("/")->body;
  std::smatch token;
  ASSERT_TRUE(std::regex_search(text, token, std::regex("'X-Upright-Token': '([0-9a-f]{32})'")));
  std::this_thread::sleep_for(1500ms);
  const test::Since pressed;
  const auto answer = page.Post("/stop", {{"X-Upright-Token", token[1].str()}}, "", "text/plain");
  const std::string said = program.rest();
  EXPECT_EQ(program.wait(), 3) << said;
  const fs::path run = only_run_in(out);
  const test::RunEnd end = test::run_end(read_text(run / "run.yaml")).value();
  EXPECT_END(end, end.reason == "stop_button");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
  EXPECT_NE(said.find("stopped from the live page"), std::string::npos) << said;
  const std::string samples = read_text(run / "samples.csv");
  const std::string last = samples.substr(samples.rfind('\n', samples.size() - 2) + 1);
  EXPECT_TRUE(std::regex_search(last, std::regex("^([^,]*,){9}0,([^,]*,){4}513,"))) << last;  // 0 V, stopped
  // The loop ended in the period after the button; the rest is what a busy machine takes to bring it there.
  EXPECT_TIMING((test::Interval{pressed.begin_s(), end.stopped_s}), end.stopped_s - pressed.begin_s() < 0.5,
                "the button is heard in time");
  EXPECT_EQ(run_upright("replay " + run.string()).exit_code, 0);
  EXPECT_EQ(run_upright("report " + run.string()).exit_code, 0);
}

TEST(Live, AStopOverHttpEndsARunAsASignalDoes) {
  test::in_real_time(stop_over_http);
}

TEST(Live, IsRefusedBeforeAnythingMoves) {
  const TemporaryFolder folder;
  const std::string out = " --out " + (folder.path() / "out").string();
  const std::string run = "run --rig " + rig + " --gains " + gains + out;
  for (const char* flags : {" --live --fast", " --live=99999", " --live=http"}) {
    const CommandResult refused = run_upright(run + flags);
    EXPECT_EQ(refused.exit_code, 2) << flags;
    EXPECT_NE(refused.err.find("--live"), std::string::npos) << refused.err;
  }
  const CommandResult experiment =
      run_upright("experiment " + config + "experiments/pivot.yaml --rig " + rig + " --live --fast" + out);
  EXPECT_EQ(experiment.exit_code, 2) << experiment.err;
  httplib::Server other;
  const int taken = other.bind_to_any_port("127.0.0.1");
  const CommandResult refused = run_upright(run + " --live=" + std::to_string(taken));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("choose another port"), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(folder.path() / "out"));
}

/// Where pictures stay.
fs::path picture_folder() {
  const fs::path folder = UPRIGHT_PICTURES;
  fs::create_directories(folder);
  return folder;
}

void keep_picture(Browser& browser, const std::string& name) {
  const std::string bytes = browser.picture();
  EXPECT_TRUE(bytes.starts_with("\x89PNG")) << name;
  std::ofstream(picture_folder() / name, std::ios::binary) << bytes;
}

/// Pixels of a plot that are drawn in a colour of the palette.
int coloured(Browser& browser, const std::string& canvas, std::string_view color) {
  const auto part = [&](std::size_t at) { return std::stoi(std::string(color.substr(at, 2)), nullptr, 16); };
  const int red = part(1), green = part(3), blue = part(5);
  std::ostringstream script;
  script << "(() => { const c = document.getElementById('" << canvas
         << "'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;"
         << "for (let i = 0; i < d.length; i += 4) if (Math.abs(d[i] - " << red << ") + Math.abs(d[i+1] - "
         << green << ") + Math.abs(d[i+2] - " << blue << ") < 60 && d[i+3] > 150) ++n; return n; })()";
  return browser.value_of(script.str()).get<int>();
}

template <class Condition>
bool comes_true(Condition&& condition) {
  for (int i = 0; i < 200; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(100ms);
  }
  return false;
}

class LivePage : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!is_installed("chromedriver") || !is_installed("chromium"))
      GTEST_SKIP() << "NOT TESTED: the live page in a browser. Install chromium and chromium-driver "
                      "(scripts/install-deps.sh --test)";
  }
};

void stop_on_page() {
  const TemporaryFolder folder;
  const fs::path runs = folder.path() / "runs";
  Process program(run_command(runs));
  const int port = port_said_by(program);
  Browser browser(folder.path() / "profile");
  browser.open("http://127.0.0.1:" + std::to_string(port) + "/");
  const bool balances = comes_true([&] { return browser.text_of("state") == "balancing"; });
  test::expect_no_late_end(runs);
  ASSERT_TRUE(balances);
  const std::string drawn = "document.getElementById('pendulum').hasAttribute('transform')";
  ASSERT_TRUE(comes_true([&] { return browser.value_of(drawn).get<bool>(); }));
  std::set<std::string> carts, pendulums, clocks;
  for (int i = 0; i < 30; ++i) {
    carts.insert(browser.value_of("document.getElementById('cart').getAttribute('transform')"));
    pendulums.insert(browser.value_of("document.getElementById('pendulum').getAttribute('transform')"));
    clocks.insert(browser.text_of("clock"));
    std::this_thread::sleep_for(100ms);
  }
  test::expect_no_late_end(runs);
  // A busy machine may show fewer pictures.
  EXPECT_GT(carts.size(), 5u);
  EXPECT_GT(pendulums.size(), 5u);
  EXPECT_GT(clocks.size(), 5u);
  for (const char* id : {"theta", "x", "volts"})
    EXPECT_TRUE(std::regex_match(browser.text_of(id), std::regex("(\u2212)?[0-9]+\\.[0-9]+")))
        << id << " " << browser.text_of(id);
  EXPECT_TRUE(std::regex_match(browser.text_of("worst"), std::regex("[0-9.]+ (\u00b5s|ms)")))
      << browser.text_of("worst");
  EXPECT_GT(coloured(browser, "theta-plot", color::angle), 100);
  EXPECT_GT(coloured(browser, "x-plot", color::cart), 100);
  EXPECT_GT(coloured(browser, "v-plot", color::voltage), 100);
  EXPECT_GT(coloured(browser, "lateness", color::good), 100);
  const Json fetched =
      browser.value_of("performance.getEntriesByType('resource').map(e => new URL(e.name).host)");
  for (const Json& host : fetched) EXPECT_EQ(host, "127.0.0.1:" + std::to_string(port));
  keep_picture(browser, "running.png");

  browser.click("stop");
  const bool stopped = comes_true([&] { return browser.text_of("state") == "stopped"; });
  test::expect_no_late_end(runs);
  EXPECT_TRUE(stopped);
  EXPECT_NE(browser.text_of("message").find("Stopped from the live page"), std::string::npos)
      << browser.text_of("message");
  keep_picture(browser, "stopped.png");
  const std::string said = program.rest();
  EXPECT_EQ(program.wait(), 3) << said;
}

TEST_F(LivePage, ShowsARunThatMovesAndStopsIt) {
  test::in_real_time(stop_on_page);
}

void show_experiment() {
  const TemporaryFolder folder;
  const fs::path file = folder.write(
      "test.yaml", "experiment:\n  name: class\n  why: a test\n  plant: " + config +
                       "plants/exponential.yaml\n  travel_m: 0.3\n  voltage_limit_v: 10\n  pieces:\n"
                       "    - {kind: observe, label: first, duration_s: 1}\n"
                       "    - {kind: multisine, label: second, amplitude_v: 4, lowest_hz: 0.3, "
                       "highest_hz: 4, lines: 8, duration_s: 6, fit_to_travel: true}\n");
  Process program({UPRIGHT_BINARY, "experiment", file.string(), "--rig", rig, "--live=0", "--out",
                   (folder.path() / "out").string()});
  const int port = port_said_by(program);
  Browser browser(folder.path() / "profile");
  browser.open("http://127.0.0.1:" + std::to_string(port) + "/");
  const bool begins = comes_true([&] { return browser.text_of("state").starts_with("second: "); });
  const bool measures = comes_true([&] { return browser.text_of("state") == "second: measuring"; });
  std::this_thread::sleep_for(3s);
  keep_picture(browser, "experiment.png");
  const bool completes = comes_true([&] { return browser.text_of("state") == "completed"; });
  test::expect_no_late_end(folder.path() / "out");
  EXPECT_TRUE(begins);
  EXPECT_TRUE(measures);
  EXPECT_TRUE(completes);
  const std::string said = program.rest();
  EXPECT_EQ(program.wait(), 0) << said;
}

TEST_F(LivePage, ShowsEachPieceOfAnExperiment) {
  test::in_real_time(show_experiment);
}

}  // namespace
}  // namespace upright::testing
