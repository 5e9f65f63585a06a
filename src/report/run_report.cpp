#include "run_report.hpp"

#include <cstdint>
#include <utility>
#include <vector>

#include "base/angle_units.hpp"
#include "html.hpp"
#include "run_data.hpp"
#include "statistics.hpp"

namespace upright {

namespace {

constexpr double mm_per_m = 1000.0, us_per_ns = 1e-3, s_per_ns = 1e-9;

std::vector<double> times_of(const std::vector<LogRecord>& rows) {
  std::vector<double> values;
  values.reserve(rows.size());
  for (const LogRecord& row : rows) values.push_back(s_per_ns * static_cast<double>(row.time_ns));
  return values;
}

/// A column of the rows, converted to another unit.
template <class Value>
std::vector<double> column_of(const std::vector<LogRecord>& rows, Value LogRecord::*member,
                              double factor = 1.0) {
  std::vector<double> values;
  values.reserve(rows.size());
  for (const LogRecord& row : rows) values.push_back(factor * static_cast<double>(row.*member));
  return values;
}

/// A plot over time. The plots of a run share their time axis.
Plot over_time(const RunData& run, const std::string& title, const std::string& unit) {
  Plot plot;
  plot.title = title;
  plot.x.label = "time [s]";
  plot.y.label = unit;
  if (!run.drawn.empty()) {
    const double first_s = s_per_ns * static_cast<double>(run.drawn.front().time_ns);
    const double last_s = s_per_ns * static_cast<double>(run.drawn.back().time_ns);
    // From zero if that needs little space, and to the end of the last period.
    plot.x.low = first_s < 0.02 * last_s ? 0.0 : first_s;
    plot.x.high = last_s + run.period_s.value_or(0.0);
  }
  return plot;
}

Series series(const RunData& run, const std::string& name, std::vector<double> values, std::string_view color,
              Series::Style style = Series::Style::line) {
  return {name, times_of(run.drawn), std::move(values), style, color, false};
}

void add_limits(Plot& plot, const std::optional<double>& limit, const std::string& name) {
  if (!limit) return;
  plot.horizontal_marks.push_back({*limit, name});
  plot.horizontal_marks.push_back({-*limit, ""});
}

void add_motion(HtmlPage& page, const RunData& run) {
  page.section("Motion");
  Plot theta = over_time(run, "pendulum angle (0 is upright)", "theta [deg]");
  theta.series = {
      series(run, "", column_of(run.drawn, &LogRecord::theta_rad, degrees_per_radian), color::angle)};
  Plot cart = over_time(run, "cart position", "x [mm]");
  cart.series = {series(run, "", column_of(run.drawn, &LogRecord::cart_m, mm_per_m), color::cart)};
  Plot voltage = over_time(run, "voltage", "V");
  voltage.series = {series(run, "requested", column_of(run.drawn, &LogRecord::voltage_requested_v),
                           color::requested, Series::Style::steps),
                    series(run, "applied", column_of(run.drawn, &LogRecord::voltage_v), color::voltage,
                           Series::Style::steps)};
  // The range of the amplifier, so that a much larger request does not compress the applied voltage.
  add_limits(voltage, run.amplifier_limit_v, "amplifier limit");
  if (run.amplifier_limit_v) {
    voltage.y.low = -1.3 * *run.amplifier_limit_v;
    voltage.y.high = 1.3 * *run.amplifier_limit_v;
    if (run.voltage_requested_v.largest() < 0.6 * *run.amplifier_limit_v) {
      voltage.horizontal_marks.clear();
      voltage.y = {"V", false, {}, {}};
    }
  }
  page.stack({theta, cart, voltage},
             "Long runs are drawn with the minimum and maximum of each pixel column.");
}

void add_closing_seconds(HtmlPage& page, const RunData& run) {
  if (run.duration_s < 2.0 * closing_s) return;
  const std::vector<double> theta = column_of(run.closing, &LogRecord::theta_rad, degrees_per_radian);
  Plot motion = over_time(run, "the last 3 s", "theta [deg]");
  motion.x.low = *motion.x.high - closing_s;
  motion.width_px = 450;
  motion.height_px = 300;
  motion.series = {{"", times_of(run.closing), theta, Series::Style::line, color::angle}};
  Plot cycle;
  cycle.title = "cart against angle";
  cycle.x.label = "x [mm]";
  cycle.y.label = "theta [deg]";
  cycle.width_px = 450;
  cycle.height_px = 300;
  cycle.series = {
      {"", column_of(run.closing, &LogRecord::cart_m, mm_per_m), theta, Series::Style::line, color::angle}};
  page.figures({motion, cycle},
               "The steady state of the loop. A closed curve on the right is a limit cycle.");
}

struct TimingColumn {
  const char* name;
  std::int64_t LogRecord::*member;
  const ValueCounts& counts_ns;
};

std::vector<TimingColumn> timing_of(const RunData& run) {
  return {{"wake-up delay", &LogRecord::wake_late_ns, run.wake_late_ns},
          {"read", &LogRecord::read_ns, run.read_ns},
          {"compute", &LogRecord::compute_ns, run.compute_ns},
          {"write", &LogRecord::write_ns, run.write_ns}};
}

std::vector<std::pair<double, std::uint64_t>> in_us(const ValueCounts& counts_ns) {
  std::vector<std::pair<double, std::uint64_t>> values;
  for (const auto& [ns, times] : counts_ns.sorted())
    values.emplace_back(us_per_ns * static_cast<double>(ns), times);
  return values;
}

void add_timing(HtmlPage& page, const RunData& run) {
  page.section("Timing");
  HtmlTable table;
  table.header = {"microseconds", "median", "99 %", "99.9 %", "maximum"};
  Plot plot = over_time(run, "time spent in each period", "microseconds");
  plot.y.logarithmic = true;
  std::vector<Plot> histograms;
  bool anything = false;
  for (const TimingColumn& column : timing_of(run)) {
    const Spread spread = column.counts_ns.spread();
    table.rows.push_back({column.name, number_text(us_per_ns * spread.median),
                          number_text(us_per_ns * spread.p99), number_text(us_per_ns * spread.p999),
                          number_text(us_per_ns * spread.largest)});
    anything = anything || spread.largest > 0.0;
    const std::string_view color = color::curve(plot.series.size());
    plot.series.push_back(series(run, column.name, column_of(run.drawn, column.member, us_per_ns), color));
    Plot counts;
    counts.title = column.name;
    counts.x.label = "microseconds";
    counts.y.label = "periods";
    counts.y.logarithmic = true;
    counts.y.low = 0.5;
    counts.y.whole = true;
    counts.width_px = 450;
    counts.height_px = 220;
    counts.series = {histogram(in_us(column.counts_ns), 60, "")};
    counts.series.front().color = color;
    histograms.push_back(counts);
  }
  if (!anything) {
    page.note(Tone::neutral, "The run used virtual time (--fast), so there is no timing to report.");
    return;
  }
  page.table(table);
  if (run.period_s) plot.horizontal_marks.push_back({*run.period_s * 1e6, "period"});
  page.figure(
      plot,
      "An overrun is a cycle that ended after the start of the next period. It is attributed to the part "
      "that took longest.");
  page.figures(histograms, "Histograms of these times. The counts are on a logarithmic scale.");
}

std::string with_unit(double value, const std::string& unit) {
  return number_text(value) + " " + unit;
}

void add_numbers(HtmlPage& page, const RunData& run) {
  page.section("Key figures");
  std::vector<std::pair<std::string, std::string>> facts = {
      {"duration", with_unit(run.duration_s, "s")},
      {"samples", std::to_string(run.rows)},
      {"largest angle", with_unit(run.theta_rad.largest() * degrees_per_radian, "deg")},
      {"largest cart travel", with_unit(run.cart_m.largest() * mm_per_m, "mm")},
      {"voltage, RMS", with_unit(run.voltage_v.root_mean_square(), "V")},
      {"voltage, largest", with_unit(run.voltage_v.largest(), "V")},
  };
  facts.insert(facts.end(), run.outcome_facts.begin(), run.outcome_facts.end());
  page.facts(facts);
}

}  // namespace

std::filesystem::path write_run_report(const std::filesystem::path& run_directory,
                                       const ProgressCallback& progress) {
  const RunData run = load_run_data(run_directory, progress);
  HtmlPage page("Run " + run.name, run.origin);
  page.answer(run.tone, run.headline, run.reason);
  for (const std::string& warning : run.warnings) page.note(Tone::warning, warning);
  add_numbers(page, run);
  add_motion(page, run);
  add_closing_seconds(page, run);
  add_timing(page, run);
  page.section("Configuration and provenance");
  page.facts(run.provenance);
  page.folded("run.yaml: the complete configuration of this run", run.run_yaml);
  std::filesystem::path file = run_directory / "report.html";
  page.write(file);
  return file;
}

}  // namespace upright
