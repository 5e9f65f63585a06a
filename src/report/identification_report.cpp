#include "identification_report.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "html.hpp"
#include "plot.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

double value_or(const Plant& plant, std::string_view kind, std::size_t index, double fallback) {
  const PlantEffect* effect = plant.find(kind);
  return effect != nullptr ? effect->values[index] : fallback;
}

/// Dry friction while sliding at a speed [N].
double dry_level_n(const Plant& plant, double speed_mps) {
  const double extra = value_or(plant, "stribeck_friction", 0, 0.0);
  const double vs = value_or(plant, "stribeck_friction", 1, 1.0);
  const double shape = value_or(plant, "stribeck_friction", 2, 2.0);
  return value_or(plant, "coulomb_friction", 0, 0.0) + extra * std::exp(-std::pow(speed_mps / vs, shape));
}

void save(const Plot& plot, const std::filesystem::path& file) {
  std::ofstream out(file);
  out << svg_file_of(plot);
  out.close();
  if (!out)
    throw ConfigError("cannot write " + file.string() +
                      ": free some space or choose another folder with --out");
}

/// The paper's Figure 3, over the data.
Plot friction_plot(const Identification& id) {
  Plot plot;
  plot.title = "Friction against velocity";
  plot.x.label = "cart velocity [m/s]";
  plot.y.label = "friction force [N]";
  plot.height_px = 360;
  Series points{"measured at constant voltage", {}, {}, Series::Style::points};
  double fastest = 0.1;
  for (const SteadyPoint& p : id.steady_points) {
    points.x.push_back(p.cart_mps);
    points.y.push_back(p.friction_n);
    fastest = std::max(fastest, std::abs(p.cart_mps));
  }
  Series breakaways{"breakaway on ramps", {}, {}, Series::Style::points};
  for (const Breakaway& b : id.breakaways) {
    breakaways.x.push_back(0.0);
    breakaways.y.push_back(b.force_n);
  }
  Series model{id.is_trustworthy() ? "identified" : "best fit, not to be used", {}, {}};
  constexpr int steps = 600;
  for (int i = -steps; i <= steps; ++i) {
    const double v = 1.1 * fastest * i / steps;
    model.x.push_back(v);
    // Between the two branches, the level at rest is any force up to breakaway.
    model.y.push_back(i == 0 ? std::nan("") : steady_friction_n(id.plant, v));
  }
  if (!points.x.empty()) plot.series.push_back(points);
  if (!breakaways.x.empty()) plot.series.push_back(breakaways);
  plot.series.push_back(model);
  return plot;
}

/// The paper's Figure 5: the measured motion, and the force the model has for it.
std::optional<Plot> slow_sine_plot(const Identification& id, const std::vector<Measurement>& runs) {
  const auto run = std::find_if(runs.begin(), runs.end(), [](const Measurement& m) {
    return m.has_cart() && m.name.find("slow_sine") != std::string::npos;
  });
  if (run == runs.end()) return std::nullopt;
  const ForceTrace trace = force_trace(*run, id.plant);
  Plot plot;
  plot.title = "Force against velocity on a slow sine";
  plot.x.label = "cart velocity [m/s]";
  plot.y.label = "friction force [N]";
  plot.height_px = 360;
  Series measured{"measured", {}, {}, Series::Style::points};
  Series model{"identified", {}, {}, Series::Style::points};
  const double s0 = value_or(id.plant, "bristle_friction", 0, 0.0);
  const double s1 = value_or(id.plant, "bristle_friction", 1, 0.0);
  const double viscous = value_or(id.plant, "viscous_friction", 0, 0.0);
  double z = 0.0;
  constexpr int substeps = 20;
  for (std::size_t k = 1; k < trace.time_s.size(); ++k) {
    const double v = trace.cart_mps[k];
    double force = steady_friction_n(id.plant, v);
    if (s0 > 0.0) {
      const double h = (trace.time_s[k] - trace.time_s[k - 1]) / substeps;
      double rate = 0.0;
      for (int i = 0; i < substeps; ++i) {
        rate = v - s0 * std::abs(v) / dry_level_n(id.plant, std::abs(v)) * z;
        z += h * rate;
      }
      force = s0 * z + s1 * rate + viscous * v;
    }
    if (k % 20 != 0) continue;
    measured.x.push_back(v);
    measured.y.push_back(trace.friction_n[k]);
    model.x.push_back(v);
    model.y.push_back(force);
  }
  plot.series = {measured, model};
  return plot;
}

}  // namespace

double steady_friction_n(const Plant& plant, double cart_mps) {
  const double sign = cart_mps < 0.0 ? -1.0 : cart_mps > 0.0 ? 1.0 : 0.0;
  return sign * dry_level_n(plant, std::abs(cart_mps)) +
         value_or(plant, "viscous_friction", 0, 0.0) * cart_mps - value_or(plant, "constant_force", 0, 0.0);
}

namespace {

void answer(HtmlPage& page, const Identification& id) {
  const std::string gap = std::isfinite(id.gap_after)
                              ? " A simulation of data that the fit did not see is " +
                                    number_text(id.gap_after, 3) + " times as far off as noise makes it."
                              : "";
  if (id.is_trustworthy()) {
    page.answer(Tone::good, std::to_string(id.parameters.size()) + " numbers identified",
                "They account for the data." + gap);
  } else if (id.verdict == Verdict::not_excited) {
    page.answer(Tone::neutral, "Not excited", "The numbers are not the rig's: " + id.residual + "." + gap);
  } else {
    page.answer(Tone::bad, "Unexplained: the numbers are not the rig's",
                "Something moves it that identify does not know, and the numbers make up for it: " +
                    id.residual + "." + gap + " What is missing, upright diagnose says.");
  }
}

}  // namespace

void write_identification_report(const Identification& id, const std::vector<Measurement>& runs,
                                 const std::filesystem::path& file) {
  HtmlPage page("Identification", std::to_string(runs.size()) + " runs");
  answer(page, id);
  HtmlTable table{{"parameter", "value", "95 % from", "to", "unit", "shown by", "goodness"}, {}, ""};
  for (const IdentifiedParameter& p : id.parameters)
    table.rows.push_back({p.name, number_within(p.value, p.low, p.high), number_within(p.low, p.low, p.high),
                          number_within(p.high, p.low, p.high), p.unit, p.source, p.goodness});
  page.table(table);
  const std::filesystem::path folder = file.parent_path();
  const Plot friction = friction_plot(id);
  page.figure(friction,
              "What friction takes at constant speed, read from the data, and the identified curve.");
  save(friction, folder / "friction.svg");
  if (const auto sine = slow_sine_plot(id, runs)) {
    page.figure(*sine, "A loop here is friction with a memory: bristles.");
    save(*sine, folder / "slow-sine.svg");
  }
  for (const std::string& note : id.notes) page.paragraph(note + ".");
  page.write(file);
}

}  // namespace upright
