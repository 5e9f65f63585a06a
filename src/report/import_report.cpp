#include "import_report.hpp"

#include <algorithm>

#include "html.hpp"
#include "plot.hpp"

namespace upright {

namespace {

/// The first samples of one quantity. A gap in the record is a gap in the curve.
Plot first_seconds(const Measurement& run, std::size_t count, const std::vector<double>& values,
                   const std::string& title, const std::string& unit, std::string_view color) {
  Plot plot;
  plot.title = title;
  plot.x.label = "time [s]";
  plot.y.label = title + " [" + unit + "]";
  Series series{"", {}, {}};
  series.color = color;
  for (std::size_t k = 0; k < count; ++k) {
    if (std::binary_search(run.breaks.begin(), run.breaks.end(), k)) {
      series.x.push_back(run.time_s[k]);
      series.y.push_back(std::numeric_limits<double>::quiet_NaN());
    }
    series.x.push_back(run.time_s[k]);
    series.y.push_back(values[k]);
  }
  plot.series = {series};
  return plot;
}

}  // namespace

void write_import_report(const Measurement& run, double seconds, const std::filesystem::path& file) {
  const auto end = std::upper_bound(run.time_s.begin(), run.time_s.end(), run.time_s.front() + seconds) -
                   run.time_s.begin();
  const auto count = static_cast<std::size_t>(end);
  HtmlPage page("First " + number_text(seconds) + " s of " + run.name, "as its dataset file reads them");
  std::vector<Plot> plots;
  if (run.has_cart())
    plots.push_back(first_seconds(run, count, run.cart_m, "cart position", "m", color::cart));
  if (run.has_theta())
    plots.push_back(first_seconds(run, count, run.theta_rad, "pendulum angle", "rad", color::angle));
  plots.push_back(first_seconds(run, count, run.voltage_v, "voltage", "V", color::voltage));
  plots.back().series.front().style = Series::Style::steps;
  page.stack(plots,
             "Check that a positive voltage pushes the cart toward larger positions, and that the angle is 0 "
             "upright, pi hanging, and grows when the pendulum leans toward larger positions.");
  for (const std::string& note : run.notes) page.paragraph(note + ".");
  page.write(file);
}

}  // namespace upright
