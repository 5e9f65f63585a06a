#include "compare_report.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/angle_units.hpp"
#include "base/number_text.hpp"
#include "html.hpp"
#include "plot.hpp"
#include "run_data.hpp"

namespace upright {

namespace {

constexpr std::size_t max_drawn = 6;  // more curves in one plot are not distinguishable

std::string in_units(double value, const Quantity& quantity) {
  return number_text(value * quantity.per_si_unit, 3) + " " + std::string(quantity.unit);
}

/// A value with its interval.
std::string estimate_text(const Estimate& estimate, const Quantity& quantity) {
  const double scale = quantity.per_si_unit;
  if (!estimate.ci95) return number_text(scale * estimate.value, 3);
  return number_text(scale * estimate.value, 3) + " (" + number_text(scale * (*estimate.ci95)[0], 3) +
         " to " + number_text(scale * (*estimate.ci95)[1], 3) + ")";
}

void add_table(HtmlPage& page, const std::vector<RunBehaviour>& runs) {
  HtmlTable table{
      {"run", "folder", "rate [Hz]", "outcome"},
      {},
      "Values over the last third of each run, with 95 % confidence intervals in brackets. Lateness of the "
      "control loop: median, 99th percentile and maximum, in microseconds."};
  for (const Quantity& quantity : quantities)
    table.header.push_back(std::string(quantity.name) + " [" + std::string(quantity.unit) + "]");
  table.header.emplace_back("lateness");
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const RunBehaviour& run = runs[k];
    const std::string ending = ending_text(run);
    std::vector<std::string> row = {run_letter(k), run.name, number_text(run.sample_rate_hz, 5),
                                    ending.empty() ? "stayed up" : ending};
    for (std::size_t q = 0; q < quantities.size(); ++q)
      row.push_back(run.behaviour ? estimate_text(run.behaviour->values[q], quantities[q]) : "-");
    row.push_back(run.lateness ? number_text(run.lateness->median_us, 3) + ", " +
                                     number_text(run.lateness->p99_us, 3) + ", " +
                                     number_text(run.lateness->largest_us, 3)
                               : "virtual time");
    table.rows.push_back(row);
  }
  page.table(table);
}

struct DrawnQuantity {
  const char *title, *unit;
  double LogRecord::*member;
  double factor;
};
constexpr DrawnQuantity drawn_quantities[] = {
    {"pendulum angle (0 is upright)", "theta [deg]", &LogRecord::theta_rad, degrees_per_radian},
    {"cart position", "x [mm]", &LogRecord::cart_m, 1e3},
    {"voltage", "V", &LogRecord::voltage_v, 1.0}};

/// The runs in one plot for each quantity. Time is counted from the first row of each.
std::vector<Plot> overlays(const std::vector<RunBehaviour>& runs, const std::vector<RunData>& data,
                           std::vector<LogRecord> RunData::*rows) {
  std::vector<Plot> plots;
  for (const DrawnQuantity& quantity : drawn_quantities) {
    Plot plot;
    plot.title = quantity.title;
    plot.x.label = "time [s]";
    plot.y.label = quantity.unit;
    for (std::size_t k = 0; k < data.size(); ++k) {
      Series series;
      series.name = run_letter(k) + ": " + runs[k].name;
      for (const LogRecord& row : data[k].*rows) {
        series.x.push_back(1e-9 * static_cast<double>(row.time_ns - (data[k].*rows).front().time_ns));
        series.y.push_back(quantity.factor * row.*quantity.member);
      }
      plot.series.push_back(std::move(series));
    }
    plots.push_back(std::move(plot));
  }
  return plots;
}

}  // namespace

std::string run_letter(std::size_t k) {
  constexpr std::size_t letters = 26;
  return k < letters ? std::string(1, static_cast<char>('A' + k)) : std::to_string(k + 1);
}

std::string difference_text(const Difference& difference) {
  const Quantity& quantity = quantities[difference.quantity];
  return std::string(quantity.name) + " " + in_units(difference.from, quantity) + " -> " +
         in_units(difference.to, quantity);
}

std::string ending_text(const RunBehaviour& run) {
  if (run.result == "completed") return "";
  const char* what = run.fell                    ? "fell after "
                     : run.result == "cut_short" ? "cut short after "
                                                 : "stopped after ";
  return what + number_text(run.ended_s, 3) + " s";
}

std::vector<std::string> comparison_sentences(const std::vector<RunBehaviour>& runs) {
  std::vector<std::string> clear, others;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const std::string name = "run " + run_letter(k) + ": ";
    if (const std::string ending = ending_text(runs[k]); !ending.empty()) clear.push_back(name + ending);
    if (!runs[k].behaviour) clear.push_back(name + runs[k].problem);
    if (k == 0) continue;
    // A fall dominates the last third, so there is no behaviour to compare.
    if (runs[k].fell || runs.front().fell) continue;
    std::string alike;
    for (const Difference& difference : differences_between(runs.front(), runs[k])) {
      if (difference.is_clear.value_or(false))
        clear.push_back(name + difference_text(difference));
      else if (!difference.is_clear)
        others.push_back(name + difference_text(difference) + " (run too short for a confidence interval)");
      else
        alike += (alike.empty() ? "" : ", ") + std::string(quantities[difference.quantity].name);
    }
    if (!alike.empty()) others.push_back(name + "no clear difference in " + alike);
    if (runs[k].sample_rate_hz != runs.front().sample_rate_hz)
      others.push_back(name + "sampled at " + number_text(runs[k].sample_rate_hz, 5) + " Hz, run A at " +
                       number_text(runs.front().sample_rate_hz, 5) +
                       " Hz, so their voltage changes per sample are not comparable");
  }
  clear.insert(clear.end(), others.begin(), others.end());
  return clear;
}

void write_compare_report(const std::vector<RunBehaviour>& runs, const std::filesystem::path& file) {
  HtmlPage page("Comparison of " + std::to_string(runs.size()) + " runs",
                "Reference: run A, " + (runs.empty() ? std::string("-") : runs.front().name));
  const std::vector<std::string> sentences = comparison_sentences(runs);
  const bool fell = std::any_of(runs.begin(), runs.end(), [](const RunBehaviour& r) { return r.fell; });
  page.answer(fell ? Tone::bad : Tone::neutral, sentences.empty() ? "Nothing to compare" : sentences.front(),
              fell ? "A run fell." : "No run fell.");
  for (std::size_t i = 1; i < sentences.size(); ++i) page.paragraph(sentences[i]);
  page.section("Key figures");
  add_table(page, runs);
  add_overlays(page, runs, "Runs overlaid");
  page.write(file);
}

void add_overlays(HtmlPage& page, const std::vector<RunBehaviour>& runs, const std::string& heading) {
  std::vector<RunData> data;
  for (std::size_t k = 0; k < std::min(runs.size(), max_drawn); ++k)
    data.push_back(load_run_data(runs[k].run));
  page.section(heading);
  page.stack(overlays(runs, data, &RunData::drawn),
             runs.size() > max_drawn ? "The first " + std::to_string(max_drawn) + " runs are drawn."
                                     : "Complete runs.");
  page.section("The last " + number_text(closing_s) + " seconds");
  page.stack(overlays(runs, data, &RunData::closing),
             "Time is counted from the start of this section of each run.");
}

}  // namespace upright
