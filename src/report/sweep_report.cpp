#include "sweep_report.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "base/angle_units.hpp"
#include "html.hpp"
#include "picture_file.hpp"
#include "plot.hpp"
#include "result_text.hpp"
#include "sweep_rows.hpp"
#include "uncertainty_map.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

using Row = SweepRow;

struct Map {
  std::vector<double> delays_s, angles_deg;
  std::map<std::pair<double, double>, int> outcome;  // by angle, delay
  std::array<std::size_t, 3> counts{};
};

Map read_map(const std::filesystem::path& folder) {
  Map map;
  std::set<double> delays, angles;
  for (const Row& row :
       read_sweep_rows(folder / "sweep.csv",
                       "theta0_rad,delay_s,outcome,theta_amplitude_rad,cart_amplitude_m,fall_time_s")) {
    const double angle = cell_number(row[0]) * degrees_per_radian, delay = cell_number(row[1]);
    std::size_t k = 0;
    while (k < outcome_names.size() && outcome_names[k] != row[2]) ++k;
    if (k == outcome_names.size())
      throw ConfigError((folder / "sweep.csv").string() + " has the unknown outcome " + row[2] +
                        ": repeat the sweep");
    ++map.counts[k];
    map.outcome[{angle, delay}] = static_cast<int>(k);
    delays.insert(delay);
    angles.insert(angle);
  }
  map.delays_s.assign(delays.begin(), delays.end());
  map.angles_deg.assign(angles.begin(), angles.end());
  return map;
}

/// The map with logarithmic axes if all values are positive. A logarithmic axis cannot show a delay of zero,
/// which is only in the table and the file.
Plot map_plot(const Map& map, const std::vector<Row>& transitions, const std::vector<Row>& margins,
              bool log_delay) {
  Plot plot;
  plot.height_px = 460;
  plot.x.label = "delay [s]";
  plot.x.logarithmic = log_delay;
  plot.y.label = "initial angle [degree]";
  plot.y.logarithmic = map.angles_deg.front() > 0.0 && map.angles_deg.size() > 2;
  HeatMap heat;
  for (const double delay : map.delays_s)
    if (delay > 0.0 || !log_delay) heat.x.push_back(delay);
  heat.y = map.angles_deg;
  for (const double angle : heat.y)
    for (const double delay : heat.x) {
      const auto it = map.outcome.find({angle, delay});
      heat.values.push_back(it == map.outcome.end() ? std::numeric_limits<double>::quiet_NaN() : it->second);
    }
  heat.classes.assign(outcome_names.begin(), outcome_names.end());
  plot.heat_map = heat;
  for (const auto& [name, column] : {std::pair{"oscillates from (0.1 ms)", 1}, {"falls from (0.1 ms)", 2}}) {
    Series line;
    line.name = name;
    line.dashed = column == 1;
    for (const Row& row : transitions) {
      line.x.push_back(cell_number(row[static_cast<std::size_t>(column)]));
      line.y.push_back(cell_number(row[0]) * degrees_per_radian);
    }
    plot.series.push_back(line);
  }
  for (const Row& row : margins) {
    const double delay = cell_number(row[1]);
    if (!(delay > 0.0) || std::isinf(delay)) continue;
    plot.vertical_marks.push_back({delay, "linear, " + row[0]});
    // The axis includes the line, so that its distance from the falls is visible.
    if (delay > map.delays_s.back()) plot.x.high = std::max(plot.x.high.value_or(0.0), 1.1 * delay);
  }
  return plot;
}

/// The result of the linear analysis in a sentence.
std::string margin_sentence(const Row& row) {
  const double delay = cell_number(row[1]);
  const std::string which = row[0] == "near rest"
                                ? "Linearised near rest with smoothed dry friction, the loop "
                                : "Linearised while the cart slides (without dry friction), the loop ";
  if (delay <= 0.0) return which + "is unstable without delay.";
  if (std::isinf(delay)) return which + "is stable for any delay.";
  return which + "loses stability at " + milliseconds(delay) + " ms and oscillates at " +
         number_text(cell_number(row[2]), 4) + " rad/s.";
}

/// The delay that is safe from every starting angle.
void answer(HtmlPage& page, const UncertaintyMap& map, const std::string& counts) {
  double safe_s = std::numeric_limits<double>::infinity();
  bool everywhere = true;
  for (const double delay_s : map.tolerated_s) {
    everywhere = everywhere && !std::isnan(delay_s);
    safe_s = std::min(safe_s, delay_s);
  }
  const std::string of_plants = " of " + number_text(map.samples, 6) + " plants fall";
  if (everywhere)
    page.answer(Tone::good, "Fewer than 5 percent" + of_plants + " up to " + milliseconds(safe_s) + " ms",
                "With the plant of the file, " + counts);
  else
    page.answer(Tone::warning, "At the shortest delay, 5 percent or more" + of_plants,
                "With the plant of the file, " + counts);
}

void add_uncertainty(HtmlPage& page, const UncertaintyMap& map, const std::filesystem::path& folder) {
  page.section("Plants that fall, over delay and initial angle");
  page.paragraph("Every point has the same plants, drawn as sweep.yaml says. The gains stay as they are.");
  const Plot plot = uncertainty_plot(map);
  page.figure(plot, "Lines: the delays at which 10, 50 and 90 percent of the plants fall.");
  save_picture(plot, folder / "uncertainty.svg");
  page.table(uncertainty_table(map));
}

}  // namespace

bool is_sweep_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "sweep.csv", ignored) ||
         std::filesystem::exists(folder / "sweep.partial", ignored);
}

std::filesystem::path write_sweep_report(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder / "sweep.csv", ignored))
    throw ConfigError(folder.string() +
                      " contains an unfinished sweep: repeat the sweep command to continue it");
  const Map map = read_map(folder);
  const std::vector<Row> transitions =
      read_sweep_rows(folder / "transitions.csv", "theta0_rad,oscillates_from_s,falls_from_s");
  if (map.outcome.empty()) throw ConfigError(folder.string() + " contains no runs: repeat the sweep");

  // Folders from older versions have no margins.
  std::vector<Row> margins;
  if (std::filesystem::exists(folder / "margins.csv", ignored))
    margins = read_sweep_rows(folder / "margins.csv", "model,critical_delay_s,crossing_radps");

  HtmlPage page("Delay sweep", folder.string());
  double first_fall = std::numeric_limits<double>::infinity();
  for (const Row& row : transitions)
    if (cell_number(row[2]) < first_fall) first_fall = cell_number(row[2]);
  const std::string counts = std::to_string(map.counts[0]) + " runs are stable, " +
                             std::to_string(map.counts[1]) + " oscillate, " + std::to_string(map.counts[2]) +
                             " fall.";
  std::optional<UncertaintyMap> uncertain;
  if (std::filesystem::exists(folder / "uncertainty.csv", ignored))
    uncertain = read_uncertainty_map(folder / "uncertainty.csv");
  if (uncertain)
    answer(page, *uncertain, counts);
  else if (std::isfinite(first_fall))
    page.answer(Tone::warning, "Falls for delays from " + milliseconds(first_fall) + " ms", counts);
  else
    page.answer(Tone::good, "No run falls at these delays", counts);
  if (uncertain) add_uncertainty(page, *uncertain, folder);
  page.section("Outcome over delay and initial angle");
  for (const Row& row : margins) page.paragraph(margin_sentence(row));
  const std::string lines = margins.empty() ? "" : " Dotted lines: critical delay of the linear analysis.";
  if (map.delays_s.size() > 3)
    page.figure(map_plot(map, transitions, margins, true), "Outcome map with logarithmic axes." + lines);
  page.figure(map_plot(map, transitions, margins, false), "Outcome map with a linear delay axis.");
  page.section("Delays at which the outcome changes");
  HtmlTable table;
  table.header = {"initial angle [degree]", "oscillates from [ms]", "falls from [ms]"};
  for (const Row& row : transitions)
    table.rows.push_back({number_text(cell_number(row[0]) * degrees_per_radian, 4),
                          milliseconds(cell_number(row[1])), milliseconds(cell_number(row[2]))});
  table.caption = "Found by bisection to 0.1 ms. A dash means: not within the delays of the sweep.";
  page.table(table);
  page.folded("sweep.yaml: the sweep with its plant and gains", file_text(folder / "sweep.yaml"));
  const std::filesystem::path file = folder / "report.html";
  page.write(file);
  return file;
}

}  // namespace upright
