#include "simulation_report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "html.hpp"
#include "plot.hpp"

namespace upright {

namespace {

/// One channel of a run, in the unit of its plots.
struct ShownChannel {
  std::string name, unit;
  double per_unit;  ///< of the plots per SI unit
  const std::vector<double>& measured;
  const std::vector<double>& simulated;
  const ChannelError& error;
};

std::vector<ShownChannel> channels_of(const Measurement& run, const RunSimulation& simulation) {
  std::vector<ShownChannel> channels;
  if (run.has_cart() && !simulation.cart_m.empty())
    channels.push_back({"cart position", "mm", 1e3, run.cart_m, simulation.cart_m, simulation.cart_error_m});
  if (run.has_theta() && !simulation.theta_rad.empty())
    channels.push_back(
        {"pendulum angle", "mrad", 1e3, run.theta_rad, simulation.theta_rad, simulation.theta_error_rad});
  return channels;
}

/// `value(k)` for the samples of all pieces, with a gap between two pieces.
template <class Value>
Series series_of(const std::string& name, const Measurement& run, const RunSimulation& simulation,
                 const Value& value) {
  Series series{name, {}, {}};
  for (const Segment& piece : simulation.pieces) {
    if (!series.x.empty()) {
      series.x.push_back(run.time_s[piece.first]);
      series.y.push_back(std::numeric_limits<double>::quiet_NaN());
    }
    for (std::size_t k = piece.first; k <= piece.last; ++k) {
      series.x.push_back(run.time_s[k]);
      series.y.push_back(value(k));
    }
  }
  return series;
}

Plot plot_over_time(const std::string& title, const std::string& label) {
  Plot plot;
  plot.title = title;
  plot.x.label = "time [s]";
  plot.y.label = label;
  return plot;
}

Plot overlay_of(const ShownChannel& channel, const Measurement& run, const RunSimulation& simulation) {
  Plot plot = plot_over_time(channel.name, channel.name + " [" + channel.unit + "]");
  Series measured = series_of("measured", run, simulation,
                              [&](std::size_t k) { return channel.per_unit * channel.measured[k]; });
  Series simulated = series_of("simulated", run, simulation,
                               [&](std::size_t k) { return channel.per_unit * channel.simulated[k]; });
  measured.color = color::measured;
  simulated.color = color::after;
  simulated.dashed = true;
  plot.series = {measured, simulated};
  return plot;
}

Plot error_of(const ShownChannel& channel, const Measurement& run, const RunSimulation& simulation) {
  Plot plot = plot_over_time("simulated minus measured", "error [" + channel.unit + "]");
  plot.height_px = 180;
  Series error = series_of("", run, simulation, [&](std::size_t k) {
    return channel.per_unit * (channel.simulated[k] - channel.measured[k]);
  });
  error.color = color::before;
  plot.series = {error};
  return plot;
}

Plot voltage_of(const Measurement& run, const RunSimulation& simulation, bool closed_loop) {
  Plot plot = plot_over_time("voltage", "voltage [V]");
  plot.height_px = 180;
  Series recorded = series_of("recorded", run, simulation, [&](std::size_t k) { return run.voltage_v[k]; });
  recorded.style = Series::Style::steps;
  recorded.color = closed_loop ? color::measured : color::voltage;
  plot.series = {recorded};
  if (!closed_loop) return plot;
  Series simulated =
      series_of("simulated", run, simulation, [&](std::size_t k) { return simulation.voltage_v[k]; });
  simulated.style = Series::Style::steps;
  simulated.color = color::after;
  plot.series.push_back(simulated);
  return plot;
}

HtmlTable errors_of(const std::vector<Measurement>& runs, const std::vector<RunSimulation>& simulations) {
  HtmlTable table{
      {"run", "quantity", "RMS error", "unit", "% of the motion", "largest", "at [s]", "pieces"},
      {},
      "Simulated minus measured over all samples of the pieces. Percent of the standard deviation "
      "of the measurement."};
  for (std::size_t r = 0; r < runs.size(); ++r)
    for (const ShownChannel& channel : channels_of(runs[r], simulations[r]))
      table.rows.push_back(
          {runs[r].name, channel.name, number_text(channel.per_unit * channel.error.rmse), channel.unit,
           number_text(channel.error.percent, 3), number_text(channel.per_unit * channel.error.largest),
           number_text(channel.error.largest_at_s), std::to_string(simulations[r].pieces.size())});
  return table;
}

/// "cart position 2.41 mm, pendulum angle 12 mrad"
std::string headline_of(const Measurement& run, const RunSimulation& simulation) {
  std::string text;
  for (const ShownChannel& channel : channels_of(run, simulation))
    text += (text.empty() ? "" : ", ") + channel.name + " " +
            number_text(channel.per_unit * channel.error.rmse, 3) + " " + channel.unit;
  return text;
}

}  // namespace

void write_simulation_report(const SimulationTitle& title, const std::vector<Measurement>& runs,
                             const std::vector<RunSimulation>& simulations,
                             const std::filesystem::path& file) {
  const bool closed_loop = !title.controller.empty();
  HtmlPage page("Simulation of " + title.plant, closed_loop ? "closed loop with " + title.controller
                                                            : "open loop, under the recorded voltages");
  page.answer(Tone::neutral, "RMS error: " + headline_of(runs.front(), simulations.front()),
              runs.size() == 1 ? "Run " + runs.front().name + "."
                               : "Run " + runs.front().name + ", the first of " +
                                     std::to_string(runs.size()) + " runs. The table has all.");
  page.table(errors_of(runs, simulations));
  constexpr std::size_t max_shown = 6;
  for (std::size_t r = 0; r < std::min(runs.size(), max_shown); ++r) {
    page.section(runs[r].name);
    std::vector<Plot> plots;
    for (const ShownChannel& channel : channels_of(runs[r], simulations[r])) {
      plots.push_back(overlay_of(channel, runs[r], simulations[r]));
      plots.push_back(error_of(channel, runs[r], simulations[r]));
    }
    plots.push_back(voltage_of(runs[r], simulations[r], closed_loop));
    page.stack(plots, "Each piece starts from the state that fits its first samples.");
  }
  if (runs.size() > max_shown)
    page.paragraph("The plots show the first " + std::to_string(max_shown) +
                   " runs. simulated.csv has the curves of all.");
  page.write(file);
}

}  // namespace upright
