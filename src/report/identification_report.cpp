#include "identification_report.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/plain_words.hpp"
#include "html.hpp"
#include "picture_file.hpp"
#include "plot.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

namespace {

/// What the effects of the plant take from the cart while it moves, without dry friction and bristles [N].
double smooth_friction_n(const Dynamics<double>& dynamics, const PlantState<double>& state) {
  return dynamics.motor_force(state, 0.0) - dynamics.cart_smooth_force(state, 0.0);
}

double steady_friction_n(const Dynamics<double>& dynamics, double cart_m, double cart_mps) {
  PlantState<double> state{};
  state.cart_m = cart_m;
  state.cart_mps = cart_mps;
  const double direction = cart_mps < 0.0 ? -1.0 : cart_mps > 0.0 ? 1.0 : 0.0;
  return direction * dynamics.cart_dry_level(cart_m, std::abs(cart_mps), direction) +
         smooth_friction_n(dynamics, state);
}

/// The paper's Figure 3 with the data.
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
  Series model{id.is_trustworthy() ? "identified" : "best fit (do not use)", {}, {}};
  const Dynamics<double> dynamics(make_model<double>(id.plant));
  constexpr int steps = 600;
  for (int i = -steps; i <= steps; ++i) {
    const double v = 1.1 * fastest * i / steps;
    model.x.push_back(v);
    // Between the two branches, the level at rest is any force up to breakaway.
    model.y.push_back(i == 0 ? std::nan("") : steady_friction_n(dynamics, 0.0, v));
  }
  if (!points.x.empty()) plot.series.push_back(points);
  if (!breakaways.x.empty()) plot.series.push_back(breakaways);
  plot.series.push_back(model);
  return plot;
}

/// The paper's Figure 5: the measured friction force and that of the model for the same motion.
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
  const Dynamics<double> dynamics(make_model<double>(id.plant));
  PlantState<double> state{};
  constexpr int substeps = 20;
  for (std::size_t k = 1; k < trace.time_s.size(); ++k) {
    state.cart_m = run->cart_m[k];
    state.cart_mps = trace.cart_mps[k];
    double force = steady_friction_n(dynamics, state.cart_m, state.cart_mps);
    if (dynamics.has_bristle_state()) {
      const double h = (trace.time_s[k] - trace.time_s[k - 1]) / substeps;
      double rate_mps = 0.0;
      for (int i = 0; i < substeps; ++i) {
        rate_mps = dynamics.derivative(state, 0.0, {}).bristle_m;
        state.bristle_m += h * rate_mps;
      }
      force = dynamics.bristle_stiffness() * state.bristle_m + dynamics.bristle_damping() * rate_mps +
              smooth_friction_n(dynamics, state);
    }
    if (k % 20 != 0) continue;
    measured.x.push_back(state.cart_mps);
    measured.y.push_back(trace.friction_n[k]);
    model.x.push_back(state.cart_mps);
    model.y.push_back(force);
  }
  plot.series = {measured, model};
  return plot;
}

}  // namespace

double steady_friction_n(const Plant& plant, double cart_mps) {
  return steady_friction_n(Dynamics<double>(make_model<double>(plant)), 0.0, cart_mps);
}

namespace {

void answer(HtmlPage& page, const Identification& id) {
  const std::string gap =
      std::isfinite(id.gap_after)
          ? " Gap on held-out data: " + number_text(id.gap_after, 3) + " (1 is the noise floor)."
          : "";
  if (id.is_trustworthy()) {
    page.answer(Tone::good, std::to_string(id.parameters.size()) + " parameters identified",
                "The model with these parameters accounts for the data." + gap);
  } else if (id.verdict == Verdict::not_excited) {
    page.answer(Tone::neutral, "Not excited: these parameters are not valid for the rig",
                "Reason: " + in_plain_words(id.residual) + "." + gap);
  } else {
    page.answer(
        Tone::bad, "Unexplained: these parameters are not valid for the rig",
        "An effect that identify does not fit acts on the rig, and the parameters compensate for it: " +
            in_plain_words(id.residual) + "." + gap + " Run upright diagnose to find the missing effect.");
  }
}

}  // namespace

void write_identification_report(const Identification& id, const std::vector<Measurement>& runs,
                                 const std::filesystem::path& file) {
  HtmlPage page("Identification", std::to_string(runs.size()) + " runs");
  answer(page, id);
  HtmlTable table{{"parameter", "value", "95 % from", "to", "unit", "shown by", "accuracy"}, {}, ""};
  for (const IdentifiedParameter& p : id.parameters)
    table.rows.push_back({p.name, number_within(p.value, p.low, p.high), number_within(p.low, p.low, p.high),
                          number_within(p.high, p.low, p.high), p.unit, p.source, p.goodness});
  page.table(table);
  const std::filesystem::path folder = file.parent_path();
  const Plot friction = friction_plot(id);
  page.figure(friction, "Friction force at constant speed: measured, and the curve of the identified model.");
  save_picture(friction, folder / "friction.svg");
  if (const auto sine = slow_sine_plot(id, runs)) {
    page.figure(*sine, "A loop shows friction that depends on the previous motion (bristles).");
    save_picture(*sine, folder / "slow-sine.svg");
  }
  for (const std::string& note : id.notes) page.paragraph(in_plain_words(note) + ".");
  page.write(file);
}

}  // namespace upright
