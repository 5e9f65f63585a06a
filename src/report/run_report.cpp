#include "upright/report/run_report.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "run_data.hpp"
#include "upright/report/html.hpp"
#include "upright/report/statistics.hpp"

namespace upright {

namespace {

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

/// The plots of one run share their time axis.
Plot over_time(const RunData& run, const std::string& title, const std::string& unit) {
  Plot plot;
  plot.title = title;
  plot.x.label = "time [s]";
  plot.y.label = unit;
  if (!run.time_s.empty()) {
    plot.x.low = run.time_s.front();
    plot.x.high = run.time_s.back();
  }
  return plot;
}

Series series(const RunData& run, const std::string& name, const std::vector<double>& values,
              Series::Style style = Series::Style::line) {
  return {name, run.time_s, values, style, -1, false};
}

void add_limits(Plot& plot, const std::optional<double>& limit, const std::string& name) {
  if (!limit) return;
  plot.horizontal_marks.push_back({*limit, name});
  plot.horizontal_marks.push_back({-*limit, ""});
}

void add_motion(HtmlPage& page, const RunData& run) {
  page.section("Motion");
  Plot theta = over_time(run, "pendulum angle (0 is upright)", "theta [deg]");
  theta.series = {series(run, "", scaled(run.theta_rad, degrees_per_radian))};
  Plot cart = over_time(run, "cart position", "x [mm]");
  cart.series = {series(run, "", scaled(run.cart_m, 1000.0))};
  Plot voltage = over_time(run, "voltage", "V");
  voltage.series = {series(run, "requested", run.voltage_requested_v, Series::Style::steps),
                    series(run, "applied", run.voltage_v, Series::Style::steps)};
  voltage.series.front().color = 5;
  voltage.series.back().color = 0;
  // A request far beyond the amplifier would flatten what was applied.
  add_limits(voltage, run.amplifier_limit_v, "amplifier limit");
  if (run.amplifier_limit_v) {
    voltage.y.low = -1.3 * *run.amplifier_limit_v;
    voltage.y.high = 1.3 * *run.amplifier_limit_v;
    if (largest_magnitude(run.voltage_requested_v) < 0.6 * *run.amplifier_limit_v) {
      voltage.horizontal_marks.clear();
      voltage.y = {"V", false, {}, {}};
    }
  }
  page.figure(theta, "");
  page.figure(cart, "");
  page.figure(voltage, "Long runs are drawn by the smallest and largest value of each pixel column.");
}

void add_closing_seconds(HtmlPage& page, const RunData& run) {
  constexpr double shown_s = 3.0;
  if (run.time_s.empty() || run.time_s.back() - run.time_s.front() < 2.0 * shown_s) return;
  const double from = run.time_s.back() - shown_s;
  const auto first = static_cast<std::size_t>(std::lower_bound(run.time_s.begin(), run.time_s.end(), from) -
                                              run.time_s.begin());
  const auto tail = [&](const std::vector<double>& values) {
    return std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(first), values.end());
  };
  Plot motion = over_time(run, "the last 3 s", "theta [deg]");
  motion.x.low = from;
  motion.width_px = 450;
  motion.height_px = 300;
  motion.series = {{"", tail(run.time_s), scaled(tail(run.theta_rad), degrees_per_radian)}};
  Plot cycle;
  cycle.title = "cart against angle";
  cycle.x.label = "x [mm]";
  cycle.y.label = "theta [deg]";
  cycle.width_px = 450;
  cycle.height_px = 300;
  cycle.series = {{"", scaled(tail(run.cart_m), 1000.0), scaled(tail(run.theta_rad), degrees_per_radian)}};
  page.figures({motion, cycle}, "What the loop settles to: a closed curve on the right is a limit cycle.");
}

struct TimingColumn {
  const char* name;
  const std::vector<double>& values;
};

std::vector<TimingColumn> timing_of(const RunData& run) {
  return {{"wake-up late", run.wake_late_us},
          {"read", run.read_us},
          {"compute", run.compute_us},
          {"write", run.write_us}};
}

void add_timing(HtmlPage& page, const RunData& run) {
  page.section("Timing");
  HtmlTable table;
  table.header = {"microseconds", "median", "99 %", "99.9 %", "largest"};
  Plot plot = over_time(run, "time spent in each period", "microseconds");
  plot.y.logarithmic = true;
  std::vector<Plot> histograms;
  int color = 0;
  bool anything = false;
  for (const TimingColumn& column : timing_of(run)) {
    const Spread spread = spread_of(column.values);
    table.rows.push_back({column.name, number_text(spread.median), number_text(spread.p99),
                          number_text(spread.p999), number_text(spread.largest)});
    anything = anything || spread.largest > 0.0;
    plot.series.push_back(series(run, column.name, column.values));
    Plot counts;
    counts.title = column.name;
    counts.x.label = "microseconds";
    counts.y.label = "periods";
    counts.y.logarithmic = true;
    counts.y.low = 0.5;
    counts.width_px = 450;
    counts.height_px = 220;
    counts.series = {histogram(column.values, 60, "")};
    counts.series.front().color = color++;
    histograms.push_back(counts);
  }
  if (!anything) {
    page.note(Tone::neutral, "The run kept virtual time (--fast): no time passed in it to be measured.");
    return;
  }
  page.table(table);
  if (run.period_s) plot.horizontal_marks.push_back({*run.period_s * 1e6, "period"});
  page.figure(plot,
              "An overrun is a cycle that ended after the next one was due; it is counted for the part that "
              "took most.");
  page.figures(histograms, "How often each took how long; counts on a logarithmic scale.");
}

std::string with_unit(double value, const std::string& unit) {
  return number_text(value) + " " + unit;
}

void add_numbers(HtmlPage& page, const RunData& run) {
  page.section("In numbers");
  const double duration = run.time_s.empty() ? 0.0 : run.time_s.back() - run.time_s.front();
  std::vector<std::pair<std::string, std::string>> facts = {
      {"duration", with_unit(duration, "s")},
      {"samples", std::to_string(run.time_s.size())},
      {"largest angle", with_unit(largest_magnitude(run.theta_rad) * degrees_per_radian, "deg")},
      {"largest cart travel", with_unit(largest_magnitude(run.cart_m) * 1000.0, "mm")},
      {"voltage, root mean square", with_unit(root_mean_square(run.voltage_v), "V")},
      {"voltage, largest", with_unit(largest_magnitude(run.voltage_v), "V")},
  };
  facts.insert(facts.end(), run.outcome_facts.begin(), run.outcome_facts.end());
  page.facts(facts);
}

}  // namespace

std::filesystem::path write_run_report(const std::filesystem::path& run_directory) {
  const RunData run = load_run_data(run_directory);
  HtmlPage page("Run " + run.name, run.origin);
  page.answer(run.tone, run.headline, run.reason);
  for (const std::string& warning : run.warnings) page.note(Tone::warning, warning);
  add_numbers(page, run);
  add_motion(page, run);
  add_closing_seconds(page, run);
  add_timing(page, run);
  page.section("Configuration and provenance");
  page.facts(run.provenance);
  page.folded("run.yaml: everything this run was made of", run.run_yaml);
  std::filesystem::path file = run_directory / "report.html";
  page.write(file);
  return file;
}

}  // namespace upright
