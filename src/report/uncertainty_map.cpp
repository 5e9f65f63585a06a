#include "uncertainty_map.hpp"

#include <cmath>
#include <limits>
#include <set>

#include "base/angle_units.hpp"
#include "result_text.hpp"
#include "sweep/uncertainty.hpp"
#include "sweep_rows.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();
constexpr double contour_shares[] = {0.1, 0.5, 0.9};

/// `rows`: how many rows were good.
[[noreturn]] void refuse(const std::filesystem::path& file, std::size_t rows) {
  throw ConfigError(file.string() + ":" + std::to_string(rows + 2) +
                    ": this is not the next row of a whole map of angles and delays: repeat the sweep");
}

std::string percent_text(double share) {
  return number_text(100.0 * share, 3) + " percent";
}

/// Where the line through two points reaches `level`.
double crossing(double x0, double y0, double x1, double y1, double level) {
  return x0 + (x1 - x0) * (level - y0) / (y1 - y0);
}

}  // namespace

UncertaintyMap read_uncertainty_map(const std::filesystem::path& file) {
  UncertaintyMap map;
  std::vector<UncertainPoint> points;
  std::set<double> angles, delays;
  for (const SweepRow& row : read_sweep_rows(file, uncertainty_header)) {
    const double angle_rad = cell_number(row[0]), delay_s = cell_number(row[1]),
                 samples = cell_number(row[2]), share = cell_number(row[3]);
    const bool first_row = points.empty();
    const bool next = first_row || angle_rad > points.back().start.theta0_rad ||
                      (angle_rad == points.back().start.theta0_rad && delay_s > points.back().start.delay_s);
    if (!next || !(samples >= 1.0 && samples <= 1e9) || !(share >= 0.0 && share <= 1.0))
      refuse(file, points.size());
    if (!first_row && samples != map.samples) refuse(file, points.size());
    map.samples = samples;
    map.share_falls.push_back(share);
    points.push_back({{angle_rad, delay_s}, {static_cast<std::uint32_t>(std::lround(share * samples)), 0}});
    angles.insert(angle_rad);
    delays.insert(delay_s);
  }
  if (points.empty() || points.size() != angles.size() * delays.size()) refuse(file, points.size());
  for (const double angle : angles) map.angles_deg.push_back(angle * degrees_per_radian);
  map.delays_s.assign(delays.begin(), delays.end());
  for (const ToleratedDelay& t : tolerated_delays(points, static_cast<std::uint32_t>(map.samples)))
    map.tolerated_s.push_back(t.delay_s);
  return map;
}

std::vector<FallContour> fall_contours(const UncertaintyMap& map) {
  std::vector<FallContour> contours;
  const std::size_t delays = map.delays_s.size();
  for (const double share : contour_shares) {
    FallContour contour{share, {}};
    for (std::size_t a = 0; a < map.angles_deg.size(); ++a) {
      const double* falls = &map.share_falls[a * delays];
      std::size_t d = 0;
      while (d < delays && falls[d] < share) ++d;
      contour.delay_s.push_back(d == 0 || d == delays ? nowhere
                                                      : crossing(map.delays_s[d - 1], falls[d - 1],
                                                                 map.delays_s[d], falls[d], share));
    }
    contours.push_back(contour);
  }
  return contours;
}

Plot uncertainty_plot(const UncertaintyMap& map) {
  Plot plot;
  plot.title = "Share of " + number_text(map.samples, 6) + " plants that fall";
  plot.height_px = 460;
  plot.x.label = "delay [s]";
  plot.y.label = "initial angle [degree]";
  HeatMap heat;
  heat.x = map.delays_s;
  heat.y = map.angles_deg;
  heat.values = map.share_falls;
  heat.label = "share that falls";
  heat.light = true;
  plot.heat_map = heat;
  for (const FallContour& contour : fall_contours(map)) {
    Series line;
    line.name = percent_text(contour.share) + " fall";
    line.dashed = contour.share != 0.5;
    line.x = contour.delay_s;
    line.y = map.angles_deg;
    if (map.angles_deg.size() == 1) line.style = Series::Style::points;
    plot.series.push_back(line);
  }
  return plot;
}

HtmlTable uncertainty_table(const UncertaintyMap& map) {
  HtmlTable table;
  table.header = {"initial angle [degree]", "fewer than 5 percent fall up to [ms]"};
  const std::vector<FallContour> contours = fall_contours(map);
  for (const FallContour& contour : contours)
    table.header.push_back(percent_text(contour.share) + " fall at [ms]");
  for (std::size_t a = 0; a < map.angles_deg.size(); ++a) {
    table.rows.push_back({number_text(map.angles_deg[a], 4), milliseconds(map.tolerated_s[a])});
    for (const FallContour& contour : contours) table.rows.back().push_back(milliseconds(contour.delay_s[a]));
  }
  table.caption = "A dash means: not between the delays of the sweep.";
  return table;
}

}  // namespace upright
