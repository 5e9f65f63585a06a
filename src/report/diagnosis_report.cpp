#include "diagnosis_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "base/input_file.hpp"
#include "diagnosis/plain_words.hpp"
#include "html.hpp"
#include "plot.hpp"
#include "result_text.hpp"
#include "upright/base/error.hpp"
#include "upright/model/effects/force_table.hpp"

namespace upright {

namespace {

using nlohmann::json;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

double number(const json& value) {
  return value.is_number() ? value.get<double>() : nan_value;
}

std::string joined(const json& names) {
  std::string text;
  for (const json& name : names) text += (text.empty() ? "" : ", ") + name.get<std::string>();
  return text;
}

void add_answer(HtmlPage& page, const json& d, const std::filesystem::path& file) {
  const std::string verdict = d.at("verdict");
  const bool numbers_alone = d.value("effects", json::array()).empty();
  const std::map<std::string, std::pair<Tone, std::string>> headlines = {
      {"explained",
       {Tone::good, numbers_alone ? "Explained: numbers of the plant file moved, as listed below"
                                  : "Explained: the model lacked the effects listed below"}},
      {"no_discrepancy", {Tone::good, "No discrepancy: the model agrees with the data"}},
      {"unexplained", {Tone::warning, "Unexplained: something is missing that no known effect accounts for"}},
      {"described",
       {Tone::warning,
        "Described, not explained: no known effect accounts for the data; the missing force is drawn below"}},
      {"not_excited", {Tone::neutral, "Not excited: these data could not show what the model may lack"}}};
  const auto known = headlines.find(verdict);
  if (known == headlines.end())
    throw ConfigError(file.string() + " has an unknown verdict: repeat the diagnosis");
  const auto& [tone, headline] = known->second;
  page.answer(tone, headline,
              "Gap on held-out data: " + number_text(number(d.at("gap").at("before"))) + " before, " +
                  number_text(number(d.at("gap").at("after"))) +
                  " after (1 is the noise floor). Residual tests: " +
                  in_plain_words(d.at("residual").get<std::string>()) + ".");
}

void add_gap(HtmlPage& page, const json& d) {
  page.section("Gap after each added effect");
  std::vector<HtmlBar> bars = {{"model as given", number(d.at("gap").at("before")), color::before}};
  for (const json& effect : d.at("effects"))
    bars.push_back(
        {"with " + effect.at("kind").get<std::string>(), number(effect.at("gap_after")), color::after});
  page.bars(
      bars, 1.0,
      "Gap: open-loop RMS error on held-out data divided by the noise floor. Each effect is added to those "
      "above it. The bars are logarithmic and begin at 1, the noise floor.");
}

/// Where an effect shows: the runs with their evidence, and the stretch that shows it most.
std::string shown_sentence(const json& effect) {
  const json most = effect.value("shows_most", json());
  if (most.is_null()) return "";
  std::string runs;
  for (const json& of : effect.at("shown_on"))
    runs += (runs.empty() ? "" : ", ") + of.at("run").get<std::string>() + " " +
            std::to_string(std::lround(100.0 * number(of.at("share")))) + " %";
  return "It shows most in " + most.at("run").get<std::string>() + " from " +
         number_text(number(most.at("from_s"))) + " to " + number_text(number(most.at("to_s"))) +
         " s. Share of each run in what shows it: " + runs + ".";
}

/// The smooth curve of a force table through these nodes, at some places between its ends.
std::vector<double> table_curve(const std::vector<double>& nodes, double from, double to,
                                const std::vector<double>& places) {
  using Table = effects::ForceTable;
  std::vector<double> values = {0.0, from, to};
  values.insert(values.end(), nodes.begin(), nodes.end());
  std::vector<double> curve;
  curve.reserve(places.size());
  for (const double place : places) curve.push_back(Table::curve(values.data(), place));
  return curve;
}

/// The curve that describes a force, with its band.
void add_curve(HtmlPage& page, const json& curve) {
  const std::vector<double> at = curve.at("at"), force = curve.at("force_n");
  if (at.size() != effects::ForceTable::node_count || force.size() != at.size() ||
      curve.at("ci95").size() != at.size())
    throw ConfigError("the curve of the force has not 13 nodes: repeat the diagnosis");
  std::vector<double> low, high, places;
  for (const json& interval : curve.at("ci95")) {
    low.push_back(number(interval.at(0)));
    high.push_back(number(interval.at(1)));
  }
  constexpr int drawn = 240;
  for (int i = 0; i <= drawn; ++i) places.push_back(at.front() + (at.back() - at.front()) * i / drawn);
  const auto smooth = [&](const std::vector<double>& nodes) {
    return table_curve(nodes, at.front(), at.back(), places);
  };
  const std::string over = curve.at("over"), unit = curve.at("unit");
  Plot plot;
  plot.title = "force_table";
  plot.x.label = (unit == "m/s" ? "cart velocity [" : "cart position [") + unit + "]";
  plot.y.label = over == "position_and_velocity" ? "N per m/s" : "N";
  plot.bands.push_back({"95 %", places, smooth(low), smooth(high)});
  plot.series.push_back({"force", places, smooth(force), Series::Style::line, color::after, false});
  plot.series.push_back({"nodes", at, force, Series::Style::points, color::after, false});
  page.figure(plot, "The missing force on the cart as a curve over " + over +
                        ", with its 95 % band. No known effect has this shape.");
}

void add_effects(HtmlPage& page, const json& d) {
  if (d.at("effects").empty()) return;
  page.section("Effects found");
  HtmlTable table{{"effect", "parameter", "value", "95 % from", "to", "unit"},
                  {},
                  "Values in model.yaml with 95 % confidence intervals."};
  for (const json& effect : d.at("effects")) {
    if (effect.contains("curve")) continue;
    for (const auto& [name, p] : effect.at("parameters").items()) {
      const double low = number(p.at("ci95").at(0)), high = number(p.at("ci95").at(1));
      table.rows.push_back({effect.at("kind"), name, number_within(number(p.at("value")), low, high),
                            number_within(low, low, high), number_within(high, low, high), p.at("unit")});
    }
  }
  if (!table.rows.empty()) page.table(table);
  for (const json& effect : d.at("effects")) {
    const std::string kind = effect.at("kind"), where = effect.at("where");
    if (effect.contains("curve")) {
      add_curve(page, effect.at("curve"));
      page.paragraph("The force: " + where + ".");
      continue;
    }
    if (!where.empty())
      page.paragraph("Residual before " + kind + " was added: " + in_plain_words(where) + ".");
    const std::string shown = shown_sentence(effect);
    if (!shown.empty()) page.paragraph(shown);
    if (!effect.at("confusable_with").empty())
      page.note(Tone::warning, "These data do not distinguish " + kind + " from " +
                                   joined(effect.at("confusable_with")) + ".");
  }
  const json& next = d.at("next_experiment");
  if (!next.is_null())
    page.note(Tone::neutral, "Next run, to distinguish them: " + next.at("name").get<std::string>() + " (" +
                                 next.at("description").get<std::string>() + ").");
}

void add_local(HtmlPage& page, const json& d) {
  const json local = d.value("helps_here_only", json::array());
  if (local.empty()) return;
  page.section("Effects that help only on a part of the data");
  HtmlTable table{{"effect", "parameter", "value", "unit", "where"},
                  {},
                  "The last column says why these effects are not in model.yaml. The values fit all runs."};
  for (const json& effect : local)
    for (const auto& [name, p] : effect.at("parameters").items())
      table.rows.push_back(
          {effect.at("kind"), name, number_text(number(p.at("value"))), p.at("unit"), effect.at("where")});
  page.table(table);
}

/// Whether what was found is the same in every run.
void add_by_run(HtmlPage& page, const json& d) {
  HtmlTable table{
      {"effect", "parameter", "run", "value", "from", "to", "unit"},
      {},
      "Each size is estimated for the run by itself, with everything else common to all runs (95 % "
      "intervals)."};
  for (const json& effect : d.at("effects"))
    for (const json& of : effect.value("by_run", json::array()))
      table.rows.push_back({effect.at("kind"), of.at("parameter"), of.at("run"),
                            number_text(number(of.at("value"))), number_text(number(of.at("ci95").at(0))),
                            number_text(number(of.at("ci95").at(1))), of.at("unit")});
  if (table.rows.empty()) return;
  page.section("Effects in each run");
  page.table(table);
}

void add_numbers(HtmlPage& page, const json& d) {
  const json numbers = d.value("numbers", json::array());
  if (numbers.empty()) return;
  page.section("Numbers of the plant file that moved");
  HtmlTable table{{"number", "file", "fitted", "believed from", "to", "unit"},
                  {},
                  "The interval is what is believed of the number before the measurement (95 %)."};
  for (const json& n : numbers)
    table.rows.push_back({n.at("number"), number_text(number(n.at("file"))),
                          number_text(number(n.at("fitted"))),
                          number_text(number(n.at("believed_within").at(0))),
                          number_text(number(n.at("believed_within").at(1))), n.at("unit")});
  page.table(table);
}

/// In words, as "cart_m -0.1 to 0.1 m".
std::string range_text(const json& ranges) {
  std::string text;
  for (const json& of : ranges)
    text += (text.empty() ? "" : ", ") + of.at("quantity").get<std::string>() + " " +
            number_text(number(of.at("low"))) + " to " + number_text(number(of.at("high"))) + " " +
            of.at("unit").get<std::string>();
  return text;
}

void add_range(HtmlPage& page, const json& d) {
  const json ranges = d.value("measured_range", json::array());
  if (ranges.empty()) return;
  page.section("Measured range");
  HtmlTable table{{"quantity", "from", "to", "unit"}, {}, "Beyond this range the model is not tested."};
  for (const json& of : ranges)
    table.rows.push_back({of.at("quantity"), number_text(number(of.at("low"))),
                          number_text(number(of.at("high"))), of.at("unit")});
  page.table(table);
}

void add_validation(HtmlPage& page, const json& d) {
  const json validation = d.value("validation", json::array());
  if (validation.empty()) return;
  page.section("Validation on runs that were not fitted");
  HtmlTable table{{"run", "model", "gap", "RMS error [m]", "RMS error [rad]"},
                  {},
                  "Open-loop simulation in segments of at most 2 s."};
  for (const json& run : validation) {
    for (const char* model : {"given", "found"}) {
      const auto cell = [&](const char* key) {
        const double value = number(run.at(model).at(key));
        return std::isfinite(value) ? number_text(value) : std::string();
      };
      table.rows.push_back({run.at("file"), model, cell("gap"), cell("cart_rmse_m"), cell("theta_rmse_rad")});
    }
    if (run.at("found_is_worse").get<bool>())
      page.note(Tone::bad, "On " + run.at("file").get<std::string>() +
                               " the model that was found is further off than the one that was given.");
    if (const json beyond = run.value("beyond", json::array()); !beyond.empty())
      page.note(Tone::neutral, run.at("file").get<std::string>() +
                                   " goes beyond the measured range, where the model is not tested: " +
                                   range_text(beyond) + ".");
  }
  page.table(table);
}

void add_residual_tests(HtmlPage& page, const json& d) {
  const json tests = d.value("residual_tests", json::array());
  if (tests.empty()) return;
  page.section("Residual tests");
  HtmlTable table{
      {"statistic", "value", "counts", "p-value", "result"},
      {},
      "The p-value is the share of residuals, drawn from the fitted model, that are at least as extreme. "
      "Something is missing if a value is beyond its limit and chance does not explain it (p-values of all "
      "tests together: Holm, 5 %). A dash: no value is beyond its limit, so none was computed."};
  for (const json& test : tests) {
    const json &value = test.at("value"), &p_value = test.at("p_value");
    table.rows.push_back({test.at("name"), value.is_null() ? "not shown" : number_text(number(value)),
                          test.at("counts").get<std::string>() + " " + number_text(number(test.at("limit"))),
                          p_value.is_null() ? "-" : number_text(number(p_value)),
                          test.at("fails").get<bool>() ? "something is missing" : "as expected"});
  }
  page.table(table);
}

void add_power(HtmlPage& page, const json& d) {
  const json detectable = d.value("detectable", json::array());
  if (detectable.empty()) return;
  page.section("What these data would have shown");
  HtmlTable table{
      {"effect", "parameter", "shown above", "usual size", "unit"},
      {},
      "A larger effect would have been found with a probability of 95 %. Of a number of the plant file, how "
      "far it may be off."};
  for (const json& each : detectable)
    table.rows.push_back({each.at("kind"), each.at("parameter"), number_text(number(each.at("size"))),
                          number_text(number(each.at("usual"))), each.at("unit")});
  page.table(table);
}

/// The cells of a CSV file without its header, `width` in each row. Empty if there is no file.
std::vector<std::vector<std::string>> read_rows(const std::filesystem::path& file, std::size_t width) {
  std::vector<std::vector<std::string>> rows;
  const std::unique_ptr<InputFile> in = InputFile::if_there(file);
  if (!in) return rows;
  std::string line;
  std::getline(*in, line);
  while (std::getline(*in, line)) {
    std::vector<std::string> row;
    std::size_t begin = 0;
    for (std::size_t end; (end = line.find(',', begin)) != std::string::npos; begin = end + 1)
      row.push_back(line.substr(begin, end - begin));
    row.push_back(line.substr(begin));
    if (row.size() != width)
      throw ConfigError(file.string() + " has an incomplete row: repeat the diagnosis");
    rows.push_back(std::move(row));
  }
  return rows;
}

/// One quantity of a held-out run: measured, and simulated with both models. The simulated lines have a gap
/// between segments, since each segment starts from its own initial state.
struct Trace {
  std::vector<double> time_s, measured, before, after;
  double before_rms = 0.0, after_rms = 0.0;
};

Trace trace_of(const std::vector<std::vector<std::string>>& rows, const std::string& run,
               std::size_t column) {
  Trace trace;
  std::string segment;
  double count = 0.0;
  for (const auto& row : rows) {
    if (row[1] != run || row[column].empty()) continue;
    const double measured = cell_number(row[column]), before = cell_number(row[column + 1]),
                 after = cell_number(row[column + 2]);
    const bool breaks = !trace.time_s.empty() && row[0] != segment;
    segment = row[0];
    trace.time_s.push_back(cell_number(row[2]));
    trace.measured.push_back(measured);
    trace.before.push_back(breaks ? nan_value : before);
    trace.after.push_back(breaks ? nan_value : after);
    trace.before_rms += (measured - before) * (measured - before);
    trace.after_rms += (measured - after) * (measured - after);
    count += 1.0;
  }
  trace.before_rms = std::sqrt(trace.before_rms / std::max(count, 1.0));
  trace.after_rms = std::sqrt(trace.after_rms / std::max(count, 1.0));
  return trace;
}

void add_traces(HtmlPage& page, const std::filesystem::path& file) {
  const std::vector<std::vector<std::string>> rows = read_rows(file, 10);
  std::vector<std::string> runs;
  for (const auto& row : rows)
    if (std::find(runs.begin(), runs.end(), row[1]) == runs.end()) runs.push_back(row[1]);
  if (runs.empty()) return;
  page.section("Measurement and simulation of held-out data");
  HtmlTable table{
      {"run", "quantity", "RMS error before", "RMS error after", "unit"},
      {},
      "RMS of measured minus simulated. Open-loop simulation with the recorded voltages, in segments. Each "
      "segment starts from the initial state that fits the model best."};
  constexpr std::size_t max_shown = 3;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    std::vector<Plot> plots;
    for (const auto& [column, label, unit] :
         {std::tuple<std::size_t, std::string, std::string>{4, "cart position", "m"},
          {7, "pendulum angle", "rad"}}) {
      const Trace trace = trace_of(rows, runs[r], column);
      if (trace.time_s.empty()) continue;
      table.rows.push_back(
          {runs[r], label, number_text(trace.before_rms), number_text(trace.after_rms), unit});
      Plot plot, errors;
      plot.title = label;
      errors.title = "measured minus simulated";
      plot.x.label = errors.x.label = "time [s]";
      plot.y.label = errors.y.label = unit;
      plot.series.push_back(
          {"before", trace.time_s, trace.before, Series::Style::line, color::before, false});
      plot.series.push_back(
          {"measured", trace.time_s, trace.measured, Series::Style::line, color::measured, false});
      plot.series.push_back({"after", trace.time_s, trace.after, Series::Style::line, color::after, true});
      std::vector<double> before = trace.before, after = trace.after;
      for (std::size_t k = 0; k < before.size(); ++k) {
        before[k] = trace.measured[k] - before[k];
        after[k] = trace.measured[k] - after[k];
      }
      errors.series.push_back({"before", trace.time_s, before, Series::Style::line, color::before, false});
      errors.series.push_back({"after", trace.time_s, after, Series::Style::line, color::after, false});
      plot.width_px = errors.width_px = 440;
      plots.push_back(plot);
      plots.push_back(errors);
    }
    align(plots);
    if (r < max_shown)
      page.figures(plots, "Held-out run " + runs[r] + ": before and after the effects were added.");
  }
  page.table(table);
}

/// The line difference of two plant files, by their longest common subsequence: "-" is removed, "+" is added.
std::string difference(const std::string& from, const std::string& to) {
  const auto lines_of = [](const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
      if (line.empty() || line[0] != '#') lines.push_back(line);
    return lines;
  };
  const std::vector<std::string> a = lines_of(from), b = lines_of(to);
  constexpr std::size_t max_pairs = 4'000'000;  // far more than plant files have
  if (b.size() > 0 && a.size() > max_pairs / b.size()) return "too long to compare\n";
  std::vector<std::vector<std::size_t>> common(a.size() + 1, std::vector<std::size_t>(b.size() + 1, 0));
  for (std::size_t i = a.size(); i-- > 0;)
    for (std::size_t j = b.size(); j-- > 0;)
      common[i][j] = a[i] == b[j] ? common[i + 1][j + 1] + 1 : std::max(common[i + 1][j], common[i][j + 1]);
  std::string text;
  for (std::size_t i = 0, j = 0; i < a.size() || j < b.size();) {
    if (i < a.size() && j < b.size() && a[i] == b[j]) {
      text += "  " + a[i++] + "\n";
      ++j;
    } else if (i < a.size() && (j == b.size() || common[i + 1][j] >= common[i][j + 1])) {
      text += "- " + a[i++] + "\n";
    } else {
      text += "+ " + b[j++] + "\n";
    }
  }
  return text;
}

void add_model(HtmlPage& page, const std::filesystem::path& folder) {
  page.section("Changes to the plant file");
  const std::string given = file_text_if_there(folder / "given.yaml"),
                    model = file_text_if_there(folder / "model.yaml");
  if (!given.empty()) page.preformatted(difference(given, model));
  page.folded("model.yaml, complete", model);
}

void add_residuals(HtmlPage& page, const std::filesystem::path& file) {
  std::vector<std::vector<double>> columns(10);
  for (const auto& row : read_rows(file, columns.size()))
    for (std::size_t i = 0; i < columns.size(); ++i) columns[i].push_back(cell_number(row[i]));
  if (columns[0].empty()) return;
  const auto against = [&](std::size_t column, const std::string& label, std::size_t value,
                           const std::string& name) {
    Plot plot;
    plot.x.label = label;
    plot.y.label = name;
    plot.series.push_back(
        {"before", columns[column], columns[value], Series::Style::points, color::before, false});
    plot.series.push_back(
        {"after", columns[column], columns[value + 1], Series::Style::points, color::after, false});
    plot.width_px = 440;
    return plot;
  };
  const auto is_there = [&](std::size_t value) {
    return std::any_of(columns[value].begin(), columns[value].end(), [](double v) { return v != 0.0; });
  };
  if (is_there(6)) {
    const std::string force = "residual force [N]";
    page.section("Residual force on held-out data");
    page.figures({against(4, "cart velocity [m/s]", 6, force), against(3, "cart position [m]", 6, force)},
                 "Force on the cart that the model would need in addition to its own, estimated by a Kalman "
                 "smoother.");
    page.figures({against(5, "voltage [V]", 6, force), against(2, "time [s]", 6, force)},
                 "The same force against voltage and time.");
  }
  if (is_there(8)) {
    const std::string torque = "residual torque [N m]";
    page.section("Residual torque on held-out data");
    page.figures({against(4, "cart velocity [m/s]", 8, torque), against(2, "time [s]", 8, torque)},
                 "Torque on the pendulum that the model would need in addition to its own.");
  }
}

struct RuleReason {
  const char* rule;
  const char* reason;
};

/// The rules that decide about adding an effect (diagnosis/decision.hpp).
constexpr RuleReason rules[] = {
    {"shown_throughout", "accepted: evidence and t value are above their limits"},
    {"borne_out", "accepted: training runs and held-out runs both support it"},
    {"overwhelming", "accepted: the evidence is above 1000"},
    {"plant_numbers", "accepted: with it, numbers of the plant file move less"},
    {"held_out_in_doubt", "accepted only if no other effect is: the held-out runs speak against it"},
    {"simulation_in_doubt", "accepted only if no other effect is: held-out segments simulate worse with it"},
    {"cannot_be", "rejected: its size is zero or physically impossible"},
    {"bends_another", "rejected: another effect would become physically impossible"},
    {"too_little_evidence", "rejected: the evidence is too small"},
    {"held_out_against", "rejected: the held-out runs speak against it"},
    {"chance", "rejected: the t value is too small, so the gain can be chance"},
    {"uncertain_size", "rejected: its size is too uncertain"},
    {"simulates_worse", "rejected: held-out segments simulate worse with it"},
    {"undecided", "the search ended before the decision"}};

void add_trials(HtmlPage& page, const json& trials) {
  HtmlTable fits{
      {"round", "effect", "evidence", "held-out evidence", "t", "size [standard errors]", "rule", "added"},
      {},
      "All complete fits of the search. t is the mean saving per quarter of a second divided by its standard "
      "error. The size is the distance from zero. The rule decided about the effect; of the accepted effects "
      "of a round, the best is added."};
  std::set<std::string> applied;
  for (const json& trial : trials) {
    const std::string rule = trial.value("rule", "");
    applied.insert(rule);
    fits.rows.push_back({std::to_string(trial.at("round").get<int>()), trial.at("kind"),
                         number_text(number(trial.at("evidence"))), number_text(number(trial.at("held_out"))),
                         number_text(number(trial.at("t"))), number_text(number(trial.at("standard_errors"))),
                         rule, trial.at("taken").get<bool>() ? "yes" : "no"});
  }
  if (fits.rows.empty()) return;
  page.section("Decisions");
  page.table(fits);
  HtmlTable reasons{
      {"rule", "meaning"}, {}, "The rules that decided. docs/reference/diagnosis-rules.md lists all."};
  for (const auto& [rule, reason] : rules)
    if (applied.contains(rule)) reasons.rows.push_back({rule, reason});
  if (!reasons.rows.empty()) page.table(reasons);
}

void add_candidates(HtmlPage& page, const json& d) {
  page.section("Ranking of candidates");
  HtmlTable table{
      {"effect", "evidence", "gap with this effect"},
      {},
      "Each effect is added alone to the model as given. Evidence: 2 ln of the likelihood ratio on the "
      "training runs."};
  for (const json& candidate : d.at("candidates"))
    table.rows.push_back({candidate.at("kind"), number_text(number(candidate.at("evidence"))),
                          number_text(number(candidate.at("gap_after")))});
  page.table(table);
}

}  // namespace

bool is_diagnosis_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "diagnosis.json", ignored);
}

std::filesystem::path write_diagnosis_report(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "report.html";
  try {
    const std::filesystem::path diagnosis = folder / "diagnosis.json";
    const json d = json::parse(file_text_if_there(diagnosis));
    HtmlPage page("Diagnosis", folder.string());
    add_answer(page, d, diagnosis);
    add_gap(page, d);
    add_effects(page, d);
    add_by_run(page, d);
    add_local(page, d);
    add_numbers(page, d);
    add_range(page, d);
    add_validation(page, d);
    add_traces(page, folder / "traces.csv");
    add_residuals(page, folder / "residuals.csv");
    add_residual_tests(page, d);
    add_power(page, d);
    add_candidates(page, d);
    add_trials(page, d.value("trials", json::array()));
    add_model(page, folder);
    for (const json& note : d.at("notes"))
      page.note(Tone::neutral, in_plain_words(note.get<std::string>()) + ".");
    page.write(file);
  } catch (const json::exception& problem) {
    throw ConfigError((folder / "diagnosis.json").string() + " cannot be read (" + problem.what() +
                      "): repeat the diagnosis");
  }
  return file;
}

}  // namespace upright
