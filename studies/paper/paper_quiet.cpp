#include "paper_quiet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "control/filter_model.hpp"
#include "report/html.hpp"
#include "report/plot.hpp"
#include "sweep/sweep.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/elementary.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr std::array<const char*, 2> plants = {"exponential", "dynamic"};

/// A controller of the time courses, from the start that the paper's caption gives.
struct Contender {
  const char *gains, *name;
  double theta0_rad;
};
constexpr Contender contenders[] = {{"viscous", "viscous gain (Figure 2)", 0.06},
                                    {"exponential", "gain (7) (Figure 4)", 0.06},
                                    {"dynamic", "gain (10) (Figure 6)", 0.02},
                                    {"quiet", "quiet", 0.06},
                                    {"quiet-friction", "quiet with friction", 0.06}};

/// The rig's loop: encoders, the gain file's rate and estimator, and an amplifier whose limit it knows.
LoopSetup loop_of(const PaperOptions& options, const RigFile& rig, const std::string& plant,
                  const std::string& gains, double limit_v) {
  LoopSetup setup;
  Plant with_limit = read_plant_file(options.config / "plants" / (plant + ".yaml"));
  with_limit.set("voltage_saturation", {limit_v});
  setup.model = make_model<double>(with_limit);
  setup.amplifier_limit_v = limit_v;
  setup.sampled = true;
  setup.cart_resolution_m = rig.calibration.cart.per_count;
  setup.angle_resolution_rad = rig.calibration.pendulum.per_count;
  setup.control = with_encoders(read_gain_file(options.config / "gains" / (gains + ".yaml")),
                                setup.cart_resolution_m, setup.angle_resolution_rad);
  if (!setup.control.has_state_estimator()) return setup;
  const Plant known = read_plant_file(setup.control.state_estimator.plant);
  setup.make_parts = [known](const ControlConfig& control) {
    return make_model_parts(control, known, known);
  };
  return setup;
}

/// A drawing whose texts are legible on the page in a narrow window too.
Plot on_page(const std::string& x, const std::string& y, int height_px) {
  Plot plot;
  plot.width_px = 560;
  plot.text_px = 14;
  plot.height_px = height_px;
  plot.x.label = x;
  plot.y.label = y;
  return plot;
}

/// Writes down how a run went, and draws the end of it.
std::string row_of(const LoopSetup& setup, const Contender& contender, const std::string& plant,
                   Series& cart) {
  constexpr double shown_s = 4.0, step_s = 0.005;
  double squares = 0.0, steps = 0.0, last_v = 0.0;
  int count = 0;
  const LoopResult result = run_with_events(
      setup, {contender.theta0_rad, 0.0}, [&](double t, const PlantState<double>& s, double v) {
        if (t >= setup.window_begin_s()) {
          squares += v * v;
          steps += (v - last_v) * (v - last_v);
          ++count;
        }
        last_v = v;
        if (t < setup.duration_s - shown_s || (!cart.x.empty() && t < cart.x.back() + step_s - 1e-9)) return;
        cart.x.push_back(t);
        cart.y.push_back(1e3 * s.cart_m);
      });
  return "| " + std::string(contender.name) + " | " + plant + " | " +
         number_text(2e3 * result.cart_amplitude_m, 3) + " | " +
         number_text(2.0 * result.theta_amplitude_rad / degree, 3) + " | " +
         number_text(std::sqrt(squares / std::max(count, 1)), 3) + " | " +
         number_text(std::sqrt(steps / std::max(count, 1)), 3) + " |\n";
}

std::string time_courses(const PaperOptions& options, const RigFile& rig, const KeepFile& keep) {
  constexpr double figures_limit_v = 10.0, duration_s = 40.0;  // as of Figures 2, 4 and 6
  std::string text =
      "\n| controller | plant | cart [mm] | angle [degree] | voltage [V rms] | step to step [V rms] |\n"
      "|---|---|---|---|---|---|\n";
  Plot plot = on_page("time [s]", "cart [mm]", 300);
  for (const Contender& contender : contenders)
    for (const char* plant : plants) {
      LoopSetup setup = loop_of(options, rig, plant, contender.gains, figures_limit_v);
      setup.duration_s = duration_s;
      Series cart;
      cart.name = contender.name;
      text += row_of(setup, contender, plant, cart);
      if (plant == plants.front()) plot.series.push_back(cart);
    }
  keep("paper/figure-10.svg", svg_file_of(plot));
  return text + "\n![The cart's last 4 s under each controller, exponential plant](paper/figure-10.svg)\n\n";
}

std::string milliseconds(double value_s) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", 1e3 * value_s);
  return std::isfinite(value_s) ? text : "beyond 120";
}

std::string range_of(const Series& falls) {
  const auto [low, high] = std::minmax_element(falls.x.begin(), falls.x.end());
  const std::string from = milliseconds(*low), to = milliseconds(*high);
  return from == to ? from : from + " to " + to;
}

/// From which delay each start falls.
Series falls_of(const LoopSetup& setup, unsigned threads) {
  constexpr double longest_s = 0.12, min_deg = 0.1, max_deg = 10.0;
  constexpr int starts = 12;
  SweepConfig config;
  config.engine = SweepEngine::reproducible;
  config.setup = setup;
  for (int i = 0; i <= std::lround(longest_s * 1e3); ++i) config.delay_s.push_back(1e-3 * i);
  for (int i = 0; i <= starts; ++i)
    config.theta0_rad.push_back(
        min_deg * elementary::power(max_deg / min_deg, static_cast<double>(i) / starts) * degree);
  Series line;
  for (const Transition& t : find_transitions(config, *make_thread_executor(config, threads))) {
    line.x.push_back(t.falls_from_s);
    line.y.push_back(t.theta0_rad / degree);
  }
  return line;
}

std::string delay_map(const PaperOptions& options, const RigFile& rig, const KeepFile& keep) {
  std::string text = "| controller | plant | starts of 0.1 to 10 degrees fall from [ms] |\n|---|---|---|\n";
  Plot plot = on_page("delay [s]", "initial angle [degree]", 380);
  plot.x.low = 0.0;
  plot.x.high = 0.12;
  plot.y.logarithmic = true;
  std::size_t color = 0;
  for (const Contender& contender : {contenders[1], contenders[3], contenders[4]})
    for (const char* plant : plants) {
      Series line =
          falls_of(loop_of(options, rig, plant, contender.gains, rig.amplifier.limit_v), options.threads);
      line.name = std::string(contender.name) + ", " + plant + " plant";
      line.color = color::curve(color++);
      text += "| " + std::string(contender.name) + " | " + plant + " | " + range_of(line) + " |\n";
      plot.series.push_back(line);
    }
  keep("paper/figure-11.svg", svg_file_of(plot));
  return text +
         "\n![From which delay a start falls, on the rig: gain (7) and the quiet controllers]"
         "(paper/figure-11.svg)\n";
}

}  // namespace

std::string paper_with_quiet(const PaperOptions& options, const RigFile& rig, const KeepFile& keep) {
  return "## The same figures with the quiet controller\n\n`config/gains/quiet.yaml` "
         "([quiet-control.md](explanation/quiet-control.md)) has a Kalman filter on the viscous plant that "
         "also estimates the unmodelled force. `quiet-friction.yaml` has an extended Kalman filter on the "
         "exponential plant. The table repeats Figures 2, 4 and 6 with these controllers: 10 V, encoders, 1 "
         "kHz, starts as in the captions (0.06 rad for the quiet controllers). It gives peak-to-peak and RMS "
         "values over the last third of 40 s.\n" +
         time_courses(options, rig, keep) + "The delay map on the rig (" +
         number_text(rig.amplifier.limit_v) +
         " V, 20 s), without a predictor; the estimators know the delay.\n\n" + delay_map(options, rig, keep);
}

}  // namespace upright
