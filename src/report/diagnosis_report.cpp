#include "upright/report/diagnosis_report.hpp"

#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "upright/model/error.hpp"
#include "upright/report/html.hpp"
#include "upright/report/plot.hpp"

namespace upright {

namespace {

using nlohmann::json;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

double number(const json& value) {
  return value.is_number() ? value.get<double>() : nan_value;
}

std::string file_text(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

std::string joined(const json& names) {
  std::string text;
  for (const json& name : names) text += (text.empty() ? "" : ", ") + name.get<std::string>();
  return text;
}

void add_answer(HtmlPage& page, const json& d) {
  const std::string verdict = d.at("verdict");
  const std::map<std::string, std::pair<Tone, std::string>> headlines = {
      {"explained", {Tone::good, "Explained: the model lacked what is listed here"}},
      {"no_discrepancy", {Tone::good, "No discrepancy: the model says what the data say"}},
      {"unexplained", {Tone::warning, "Unexplained: something is missing that no known effect accounts for"}},
      {"not_excited", {Tone::neutral, "Not excited: too little moves in these data to show anything"}}};
  const auto& [tone, headline] = headlines.at(verdict);
  page.answer(
      tone, headline,
      "Gap on held-out data, in units of the noise: " + number_text(number(d.at("gap").at("before"))) +
          " before, " + number_text(number(d.at("gap").at("after"))) +
          " after. Remaining: " + d.at("residual").get<std::string>() + ".");
}

void add_gap(HtmlPage& page, const json& d) {
  page.section("How the gap shrinks");
  Plot plot;
  plot.x.label = "step: 0 is the model as given, then one effect after the other";
  plot.y = {"gap [noise standard deviations]", true, {}, {}};
  Series bars{"", {0.0}, {number(d.at("gap").at("before"))}, Series::Style::bars, -1, false};
  HtmlTable table{{"step", "effect", "gap before", "gap after"}, {}, ""};
  for (const json& effect : d.at("effects")) {
    bars.x.push_back(static_cast<double>(bars.x.size()));
    bars.y.push_back(number(effect.at("gap_after")));
    table.rows.push_back({std::to_string(bars.x.size() - 1), effect.at("kind"),
                          number_text(number(effect.at("gap_before"))),
                          number_text(number(effect.at("gap_after")))});
  }
  plot.series.push_back(bars);
  plot.horizontal_marks.push_back({1.0, "noise floor"});
  page.figure(plot, "Root mean square of the held-out innovations in units of the estimated noise.");
  if (!table.rows.empty()) page.table(table);
}

void add_effects(HtmlPage& page, const json& d) {
  if (d.at("effects").empty()) return;
  page.section("What was found");
  HtmlTable table{
      {"effect", "parameter", "value", "from", "to", "unit"}, {}, "Intervals hold with 95 percent."};
  for (const json& effect : d.at("effects"))
    for (const auto& [name, p] : effect.at("parameters").items())
      table.rows.push_back({effect.at("kind"), name, number_text(number(p.at("value")), 5),
                            number_text(number(p.at("ci95").at(0)), 5),
                            number_text(number(p.at("ci95").at(1)), 5), p.at("unit")});
  page.table(table);
  for (const json& effect : d.at("effects")) {
    const std::string kind = effect.at("kind"), where = effect.at("where");
    if (!where.empty()) page.paragraph(kind + ": before it was added, " + where + ".");
    if (!effect.at("confusable_with").empty())
      page.note(Tone::warning,
                "These data cannot tell " + kind + " from " + joined(effect.at("confusable_with")) + ".");
  }
  const json& next = d.at("next_experiment");
  if (!next.is_null())
    page.note(Tone::neutral,
              "The next run that would tell them apart: " + next.at("name").get<std::string>() + " (" +
                  next.at("description").get<std::string>() + ").");
}

void add_residuals(HtmlPage& page, const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line)) return;
  std::vector<std::vector<double>> columns(10);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::size_t i = 0;
    for (std::string cell; i < columns.size() && std::getline(cells, cell, ','); ++i)
      columns[i].push_back(std::strtod(cell.c_str(), nullptr));
    if (i != columns.size())
      throw ConfigError("make the diagnosis anew: " + file.string() + " has a row that is cut off");
  }
  if (columns[0].empty()) return;
  page.section("The residual force on held-out data");
  const auto against = [&](std::size_t column, const std::string& label) {
    Plot plot;
    plot.x.label = label;
    plot.y.label = "residual force [N]";
    plot.series.push_back({"before", columns[column], columns[6], Series::Style::points, 1, false});
    plot.series.push_back({"after", columns[column], columns[7], Series::Style::points, 0, false});
    plot.width_px = 440;
    return plot;
  };
  page.figures({against(4, "cart velocity [m/s]"), against(3, "cart position [m]")},
               "The force on the cart that the model would need beside its own, by a Kalman smoother.");
  page.figures({against(5, "voltage [V]"), against(2, "time [s]")}, "The same against voltage and time.");
}

void add_candidates(HtmlPage& page, const json& d) {
  page.section("Candidates of the first round");
  HtmlTable table{
      {"effect", "evidence", "gap with it"}, {}, "Evidence: fall of minus twice the log likelihood."};
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
    const json d = json::parse(file_text(folder / "diagnosis.json"));
    HtmlPage page("Diagnosis", folder.string());
    add_answer(page, d);
    add_gap(page, d);
    add_effects(page, d);
    add_residuals(page, folder / "residuals.csv");
    add_candidates(page, d);
    page.section("The model");
    page.folded("model.yaml", file_text(folder / "model.yaml"));
    for (const json& note : d.at("notes")) page.note(Tone::neutral, note.get<std::string>() + ".");
    page.write(file);
  } catch (const json::exception& problem) {
    throw ConfigError("make the diagnosis anew: " + (folder / "diagnosis.json").string() +
                      " cannot be read (" + problem.what() + ")");
  }
  return file;
}

}  // namespace upright
