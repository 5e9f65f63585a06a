// Every kind of report in a real browser as wide as a telephone: nothing scrolls sideways, no word is broken,
// and the texts of plots can be read. Pictures of the pages stay in the test's run folder.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <regex>

#include "base/palette.hpp"
#include "browser.hpp"
#include "command.hpp"
#include "report/identification_report.hpp"
#include "report/simulation_report.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
const std::string rig = " --rig " + config + "rigs/simulated.yaml";

constexpr int narrow_px = 400, wide_px = 1200;
constexpr double min_font_px = 9.0;

/// What a page measures itself: its width, the smallest text of its drawings, and the cells that are narrower
/// than their longest word.
const std::string measure = R"((() => {
  const shown = e => e.getClientRects().length > 0 && e.textContent.trim() !== '';
  const fonts = [...document.querySelectorAll('svg text')].filter(shown).map(t => {
    const m = t.getScreenCTM();
    return parseFloat(getComputedStyle(t).fontSize) * Math.hypot(m.a, m.b);
  });
  const broken = [];
  for (const cell of document.querySelectorAll('td, th, dt, dd, li')) {
    if (!shown(cell) || cell.querySelector('svg')) continue;
    const words = document.createElement('div');
    words.style.cssText = 'position:absolute;visibility:hidden;width:min-content;overflow-wrap:normal';
    words.textContent = cell.textContent;
    cell.appendChild(words);
    const needed = words.getBoundingClientRect().width;
    words.remove();
    const style = getComputedStyle(cell);
    const room = cell.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
    if (room < needed - 1) broken.push(cell.textContent);
  }
  return {width: document.documentElement.scrollWidth, texts: fonts.length,
          smallest: fonts.length ? Math.min(...fonts) : 0, broken: broken};
})())";

class ReportPages : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!is_installed("chromedriver") || !is_installed("chromium"))
      GTEST_SKIP() << "NOT TESTED: reports in a browser. Install chromium and chromium-driver "
                      "(scripts/install-deps.sh --test)";
    browser_ = std::make_unique<Browser>(folder_.path() / "profile");
  }

  void expect_readable(const fs::path& page, const std::string& name) {
    ASSERT_TRUE(fs::exists(page)) << page;
    for (const int width : {narrow_px, wide_px}) {
      browser_->set_width(width);
      browser_->open("file://" + page.string());
      const Json found = browser_->value_of(measure);
      EXPECT_LE(found.at("width").get<int>(), width) << name << " scrolls sideways";
      EXPECT_TRUE(found.at("broken").empty()) << name << " at " << width << ": " << found.at("broken").dump();
      if (found.at("texts").get<int>() > 0) {
        EXPECT_GE(found.at("smallest").get<double>(), min_font_px) << name << " at " << width;
      }
      fs::create_directories(UPRIGHT_PICTURES);
      std::ofstream(fs::path(UPRIGHT_PICTURES) / (name + "-" + std::to_string(width) + ".png"),
                    std::ios::binary)
          << browser_->picture();
    }
  }

  fs::path report_of(const fs::path& path) {
    const CommandResult result = run_upright("report " + shell_quoted(path.string()));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return path / "report.html";
  }

  fs::path fast_run(const std::string& flags) {
    const CommandResult result =
        run_upright("run --fast" + rig + " --gains " + config + "gains/exponential.yaml --theta0-deg 3 " +
                    flags + " --out " + (folder_.path() / "runs").string());
    const std::size_t end = result.out.find_last_not_of('\n');
    return result.out.substr(result.out.rfind('\n', end) + 1, end - result.out.rfind('\n', end));
  }

  TemporaryFolder folder_;
  std::unique_ptr<Browser> browser_;
};

TEST_F(ReportPages, OfRunsAreReadableOnATelephone) {
  expect_readable(report_of(fast_run("--duration 12")), "run");
  expect_readable(report_of(fast_run("--duration 12 --delay 0.03")), "fallen-run");
}

TEST_F(ReportPages, OfASweepAreReadableOnATelephone) {
  const fs::path file = folder_.write(
      "sweep.yaml", "sweep:\n  plant: " + config + "plants/exponential.yaml\n  gains: " + config +
                        "gains/exponential.yaml\n  loop: sampled\n  rig: " + config +
                        "rigs/simulated.yaml\n  theta0_deg: {from: 0.5, to: 5, count: 4, spacing: log}\n"
                        "  delay_s: {from: 0.0, to: 0.04, count: 11}\n  duration_s: 4\n"
                        "  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n  engine: fast\n");
  const fs::path out = folder_.path() / "sweep";
  ASSERT_EQ(run_upright("sweep " + file.string() + " --out " + out.string()).exit_code, 0);
  expect_readable(report_of(out), "sweep");
}

TEST_F(ReportPages, OfAnExperimentAreReadableAndLeadToItsRuns) {
  const fs::path file = folder_.write(
      "test.yaml",
      "experiment:\n  name: every_kind_of_piece_with_a_long_name\n  why: a test\n  plant: " + config +
          "plants/exponential.yaml\n  gains: " + config +
          "gains/exponential.yaml\n  travel_m: 0.34\n  voltage_limit_v: 10\n  pieces:\n"
          "    - {kind: ramp, rate_v_per_s: 0.5}\n"
          "    - {kind: closed_loop, set_points_m: [0, 0.05], hold_s: 3}\n"
          "    - {kind: delay_sweep, delay_s: [0, 0.022, 0.045], duration_s: 12, start: hand}\n");
  const fs::path out = folder_.path() / "experiment";
  ASSERT_EQ(run_upright("experiment " + file.string() + rig + " --fast --out " + out.string()).exit_code, 0);
  const fs::path page = report_of(out);
  expect_readable(page, "experiment");
  const std::string html = read_text(page);
  int links = 0;
  const std::regex link("href=\"([^\"]*)\"");
  for (auto it = std::sregex_iterator(html.begin(), html.end(), link); it != std::sregex_iterator();
       ++it, ++links)
    EXPECT_TRUE(fs::exists(out / (*it)[1].str())) << (*it)[1];
  EXPECT_EQ(links, 10) << "each of 5 runs from its drawing and from the table";
  for (const char* outcome : {"stable", "oscillating", "fell"}) {
    const std::string color(color::of_outcome(outcome));
    EXPECT_NE(html.find("fill=\"" + color + "\"/></svg>rig, " + outcome), std::string::npos) << outcome;
  }
}

TEST_F(ReportPages, OfADiagnosisAreReadableOnATelephone) {
  const fs::path folder = folder_.path() / "diagnosis";
  const auto effect = [](const char* kind, double before, double after) {
    return Json{{"kind", kind},
                {"gap_before", before},
                {"gap_after", after},
                {"parameters",
                 {{"coefficient_nms2_per_rad2",
                   {{"value", 0.0123456}, {"ci95", {0.012, 0.0127}}, {"unit", "N m s^2/rad^2"}}}}},
                {"confusable_with", {"position_dependent_friction"}},
                {"where", "the residual force goes with the direction of motion"},
                {"shown_on", {{{"run", "20261123T090248Z-demo5"}, {"evidence", 11061.4}, {"share", 1.0}}}},
                {"shows_most",
                 {{"run", "20261123T090248Z-demo5"}, {"from_s", 1.25}, {"to_s", 1.45}, {"evidence", 812.3}}}};
  };
  const Json local = {{"kind", "cogging_force"},
                      {"parameters", {{"amplitude_n", {{"value", 1.9}, {"unit", "N"}}}}},
                      {"where", "what 20261123T090248Z-demo4 says of it makes 20261123T090248Z-demo5 worse"}};
  const Json moved = {{"number", "pendulum.inertia_about_pivot_kgm2"},
                      {"unit", "kg m^2"},
                      {"file", 0.0225},
                      {"fitted", 0.0231},
                      {"believed_within", {0.0176, 0.0274}}};
  const auto score = [](double gap) {
    return Json{{"gap", gap}, {"cart_rmse_m", 0.0012}, {"theta_rmse_rad", nullptr}};
  };
  const Json validated = {
      {"file", "20261123T090248Z-demo6"},
      {"given", score(2.0)},
      {"found", score(3.0)},
      {"found_is_worse", true},
      {"beyond", {{{"quantity", "cart_m"}, {"unit", "m"}, {"low", -0.1}, {"high", 0.31}}}}};
  const Json detectable = {{"kind", "position_dependent_friction"},
                           {"parameter", "slope_n_per_m"},
                           {"unit", "N/m"},
                           {"size", 0.061},
                           {"usual", 1.0}};
  const Json trial = {{"round", 1},          {"kind", "position_dependent_friction"},
                      {"evidence", 11061.4}, {"held_out", -7512.1},
                      {"t", 12345.678},      {"standard_errors", 1e9},
                      {"taken", true},       {"rule", "shown_throughout"}};
  const Json document = {
      {"verdict", "explained"},
      {"gap", {{"before", 1492.3}, {"after", 1.0}}},
      {"effects", {effect("pivot_quadratic_drag", 1492.3, 16.8), effect("coulomb_friction", 16.8, 1.0)}},
      {"candidates",
       {{{"kind", "position_dependent_friction"}, {"evidence", 11061.4}, {"gap_after", 7512.0}}}},
      {"trials", {trial}},
      {"helps_here_only", {local}},
      {"numbers", {moved}},
      {"measured_range", {{{"quantity", "cart_m"}, {"unit", "m"}, {"low", -0.1}, {"high", 0.1}}}},
      {"validation", {validated}},
      {"detectable", {detectable}},
      {"residual", "what is left is the sensors' own noise"},
      {"next_experiment", nullptr},
      {"notes", Json::array()}};
  folder_.write("diagnosis/diagnosis.json", document.dump());
  std::string traces = "segment,run,time_s,voltage_v,cart_m,before,after,theta_rad,before,after\n";
  std::string residuals =
      "run,segment,time_s,cart_m,cart_mps,voltage_v,force,force_after,torque,torque_after\n";
  for (int i = 0; i < 3000; ++i) {
    const double t = 1e-3 * i, x = 0.05 * std::sin(3.0 * t);
    const std::string xs = std::to_string(x), half = std::to_string(0.5 * x);
    traces += "0,20261123T090248Z-demo5," + std::to_string(t) + ",1," + xs + "," + half + "," + xs + "," +
              half + "," + xs + "," + half + "\n";
    residuals += "0,0," + std::to_string(t) + "," + xs + "," + half + ",1," + xs + "," + half + "," + xs +
                 "," + half + "\n";
  }
  folder_.write("diagnosis/traces.csv", traces);
  folder_.write("diagnosis/residuals.csv", residuals);
  folder_.write("diagnosis/model.yaml", "plant: {}\n");
  const fs::path page = report_of(folder);
  expect_readable(page, "diagnosis");
  const std::string html = read_text(page);
  for (const char* bar : {">model as given<", ">with pivot_quadratic_drag<", ">with coulomb_friction<"})
    EXPECT_NE(html.find(bar), std::string::npos) << "no bar for " << bar;
  EXPECT_FALSE(std::regex_search(html, std::regex("[0-9]e[+-][0-9]+</"))) << "a number is not for people";
  for (const char* part :
       {"It shows most in 20261123T090248Z-demo5 from 1.25 to 1.45 s", ">cogging_force<",
        ">pendulum.inertia_about_pivot_kgm2<", ">slope_n_per_m<",
        "On 20261123T090248Z-demo6 the model that was found is further off",
        "demo6 goes beyond the measured range, where the model is not tested: cart_m -0.1 to 0.31 m."})
    EXPECT_NE(html.find(part), std::string::npos) << "the page does not say: " << part;
  for (const char* rule : {">shown_throughout<", "accepted: evidence and t value are above their limits"})
    EXPECT_NE(html.find(rule), std::string::npos) << "the page does not explain the decision: " << rule;
}

TEST_F(ReportPages, OfADescribedForceDrawItsCurve) {
  Json at = Json::array(), force = Json::array(), intervals = Json::array();
  for (int i = 0; i < 13; ++i) {
    at.push_back(-0.6 + 0.1 * i);
    force.push_back(0.2 * std::sin(i));
    intervals.push_back({0.2 * std::sin(i) - 0.05, 0.2 * std::sin(i) + 0.05});
  }
  const Json table = {
      {"kind", "force_table"},
      {"gap_before", 6.0},
      {"gap_after", 1.0},
      {"parameters", {{"force_01_n", {{"value", 0.0}, {"ci95", {-0.1, 0.1}}, {"unit", "N"}}}}},
      {"confusable_with", Json::array()},
      {"where", "a curve over the velocity (evidence 977)"},
      {"shown_on", Json::array()},
      {"shows_most", nullptr},
      {"curve",
       {{"over", "velocity"}, {"unit", "m/s"}, {"at", at}, {"force_n", force}, {"ci95", intervals}}}};
  const Json document = {{"verdict", "described"},
                         {"gap", {{"before", 6.0}, {"after", 1.0}}},
                         {"effects", {table}},
                         {"candidates", Json::array()},
                         {"residual", "what is left is the sensors' own noise"},
                         {"next_experiment", nullptr},
                         {"notes", Json::array()}};
  folder_.write("diagnosis/diagnosis.json", document.dump());
  folder_.write("diagnosis/model.yaml", "plant: {}\n");
  const fs::path page = report_of(folder_.path() / "diagnosis");
  expect_readable(page, "diagnosis");
  const std::string html = read_text(page);
  for (const char* part : {"Described, not explained", "as a curve over velocity", "cart velocity [m/s]",
                           "a curve over the velocity (evidence 977)"})
    EXPECT_NE(html.find(part), std::string::npos) << "the page does not say: " << part;
  EXPECT_EQ(html.find(">force_01_n<"), std::string::npos) << "the nodes are in the picture";
}

TEST_F(ReportPages, OfAnIdentificationAreReadableOnATelephone) {
  Identification id;
  for (const char* name :
       {"viscous_friction.coefficient_n_per_mps", "force_per_volt_n_if_the_mass_is_known"}) {
    IdentifiedParameter p;
    p.name = name;
    p.unit = "N s/m";
    p.value = 4.03e-6;
    p.low = -1.4e-5;
    p.high = 2.3e-5;
    p.source = "speeds at constant voltages; the back-EMF is the plant file's";
    p.goodness = "known to 12 %";
    id.parameters.push_back(p);
  }
  const fs::path page = folder_.path() / "report.html";
  write_identification_report(id, {}, page);
  expect_readable(page, "identification");
}

TEST_F(ReportPages, OfASimulationAreReadableOnATelephone) {
  Measurement run;
  run.name = "20261123T090248Z-a-record-with-a-long-name";
  RunSimulation simulation;
  simulation.pieces = {{0, 0, 999}, {0, 1000, 1999}};
  simulation.samples = 2000;
  for (int k = 0; k < 2000; ++k) {
    const double t = 1e-3 * k;
    run.time_s.push_back(t);
    run.voltage_v.push_back(std::sin(40.0 * t));
    run.cart_m.push_back(0.05 * std::sin(3.0 * t));
    run.theta_rad.push_back(3.14 + 0.5 * std::cos(5.0 * t));
    simulation.voltage_v.push_back(run.voltage_v.back());
    simulation.cart_m.push_back(0.05 * std::sin(3.1 * t));
    simulation.theta_rad.push_back(3.14 + 0.5 * std::cos(5.1 * t));
  }
  simulation.cart_error_m = {0.0031, 8.7, 0.0052, 1.999};
  simulation.theta_error_rad = {0.0123, 3.1, 0.0421, 1.999};
  const fs::path page = folder_.path() / "report.html";
  write_simulation_report({"config/plants/with-a-long-name.yaml", "config/gains/exponential.yaml"}, {run},
                          {simulation}, page);
  expect_readable(page, "simulation");
}

}  // namespace
}  // namespace upright::testing
