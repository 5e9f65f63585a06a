#include "upright/report/paper.hpp"

#include <cmath>
#include <fstream>
#include <numbers>
#include <vector>

#include "upright/analysis/gain_design.hpp"
#include "upright/analysis/sweep.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/report/html.hpp"
#include "upright/report/plot.hpp"

namespace upright {

namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double paper_smoothing = 100.0;  // the paper's delta
constexpr double stable_below_rad = 0.0016;

/// One way of looking at the loop: a plant, gains, and how much of the rig is in it.
struct Case {
  std::string plant = "exponential";
  std::string gains = "exponential";
  double limit_v = 0.0;  // 0: no limit
  double smoothing = 0.0;
  bool sampled = false;
  double filter_hz = 50.0;
  bool encoders = false;
};

class Paper {
 public:
  Paper(std::filesystem::path folder, const PaperOptions& options)
      : folder_(std::move(folder)),
        options_(options),
        rig_(read_rig_file(options.config / "rigs/simulated.yaml")) {
    std::error_code error;
    std::filesystem::create_directories(folder_ / "paper", error);
  }

  void write() {
    say("# The paper, recomputed\n");
    say("Written by `scripts/reproduce-paper.sh`. Every number under \"here\" is from a run made by that "
        "command; "
        "the paper's are quoted beside it. Delays at which the outcome changes are found by bisection to 0.1 "
        "ms, "
        "runs last 20 s, \"stable\" is an amplitude (half of peak to peak over the last third) below 0.0016 "
        "rad, "
        "\"falls\" is 1 rad.\n");
    gains();
    friction_curves();
    time_courses();
    saturation();
    basin_of_exponential();
    basin_of_dynamic();
    prediction();
    effect_by_effect();
    save("paper.md", text_);
  }

 private:
  void gains() {
    part("gains");
    say("## Gains, equations (7) and (10)\n");
    say("| model | | k1 | k2 | k3 | k4 |\n|---|---|---|---|---|---|");
    gain_rows("exponential");
    gain_rows("dynamic");
    say("\nWith bristles, z - x drifts away from the control: `upright design` eliminates it and gives the "
        "gain on x "
        "as k1. The printed k1 is half of it; the other half would act on z, which is not measured.\n");
  }

  void gain_rows(const std::string& model) {
    const GainDesign design = design_gains(plant(model), {}, paper_smoothing);
    const Gains printed = read_gain_file(options_.config / "gains" / (model + ".yaml")).gains;
    say("| " + model + " | paper | " + number_text(printed.cart_position_v_per_m, 7) + " | " +
        number_text(printed.pendulum_angle_v_per_rad, 7) + " | " +
        number_text(printed.cart_velocity_v_per_mps, 7) + " | " +
        number_text(printed.pendulum_rate_v_per_radps, 7) + " |");
    say("| | here | " + number_text(design.gains[0], 7) + " | " + number_text(design.gains[1], 7) + " | " +
        number_text(design.gains[2], 7) + " | " + number_text(design.gains[3], 7) + " |");
  }

  void friction_curves() {
    part("figures 3 and 5");
    say("## Figures 3 and 5: the two friction models\n");
    const Dynamics<double> rigid(make_model<double>(plant("exponential")));
    Series curve;
    for (int i = -400; i <= 400; ++i) {
      const double v = 0.002 * i;
      PlantState<double> state;
      state.cart_mps = v;
      const double smooth = rigid.cart_smooth_force(state, 0.0) + rigid.base().back_emf_n_per_mps * v;
      curve.x.push_back(v);
      curve.y.push_back(smooth - sign_of(v) * rigid.cart_dry_level(0.0, std::abs(v), sign_of(v)));
    }
    draw("figure-3", "Figure 3: exponential friction", "cart velocity [m/s]", "friction [N]", {curve}, 300);

    const Dynamics<double> bristles(make_model<double>(plant("dynamic")));
    Series loop;
    PlantState<double> state;
    constexpr double step_s = 1e-4, period_s = 4.0 * std::numbers::pi;
    const auto steps = static_cast<int>(2.0 * period_s / step_s);
    for (int i = 0; i < steps; ++i) {
      const auto rate = [&](double t, double z) {
        state.cart_mps = 0.8 * std::sin(0.5 * t);
        state.bristle_m = z;
        return bristles.derivative(state, 0.0, {}).bristle_m;
      };
      const double t = i * step_s, z = state.bristle_m;
      const double k1 = rate(t, z);
      const double v = state.cart_mps;
      if (t >= period_s && i % 50 == 0) {
        const double smooth = bristles.cart_smooth_force(state, 0.0) + bristles.base().back_emf_n_per_mps * v;
        loop.x.push_back(v);
        loop.y.push_back(smooth - bristles.bristle_stiffness() * z - bristles.bristle_damping() * k1);
      }
      const double k2 = rate(t + step_s / 2, z + step_s / 2 * k1),
                   k3 = rate(t + step_s / 2, z + step_s / 2 * k2);
      const double k4 = rate(t + step_s, z + step_s * k3);
      state.bristle_m = z + step_s / 6 * (k1 + 2 * (k2 + k3) + k4);
    }
    draw("figure-5", "Figure 5: dynamic friction at v = 0.8 sin(0.5 t)", "cart velocity [m/s]",
         "friction [N]", {loop}, 300);
  }

  void time_courses() {
    part("figures 2, 4 and 6");
    say("## Figures 2, 4 and 6: the three controllers on the rig\n");
    say("Simulated with a 10 V limit, encoders, velocity filter and 1 kHz, 40 s; peak to peak over the last "
        "third. "
        "The viscous gain (not printed in the paper) is the LQR gain of the viscous model.\n");
    say("| gain | plant | cart [mm] | angle [degree] |\n|---|---|---|---|");
    const std::pair<const char*, const char*> figures[] = {
        {"viscous", "figure-2"}, {"exponential", "figure-4"}, {"dynamic", "figure-6"}};
    for (const auto& [gain, file] : figures) {
      std::vector<Series> angles, positions;
      for (const char* model : {"exponential", "dynamic"}) {
        Case c = on_rig(model, gain);
        c.limit_v = 10.0;
        LoopSetup setup = setup_of(c);
        setup.duration_s = 40.0;
        Series angle, position;
        angle.name = position.name = std::string(model) + " friction";
        const LoopResult result =
            run_with_events(setup, {0.06, 0.0}, [&](double t, const PlantState<double>& s, double) {
              constexpr double shown_s = 10.0, step_s = 0.01;
              if (t > shown_s || (!angle.x.empty() && t < angle.x.back() + step_s - 1e-9)) return;
              angle.x.push_back(t);
              angle.y.push_back(s.theta_rad / degree);
              position.x.push_back(t);
              position.y.push_back(1e3 * s.cart_m);
            });
        say("| " + std::string(gain) + " | " + model + " | " + number_text(2e3 * result.cart_amplitude_m, 3) +
            " | " + number_text(2.0 * result.theta_amplitude_rad / degree, 3) + " |");
        angles.push_back(angle);
        positions.push_back(position);
      }
      figure_texts_.push_back({std::string(file) + "-angle",
                               "Figure " + std::string(file).substr(7) + ": gain of the " + gain + " model"});
      plot(std::string(file) + "-angle", figure_texts_.back().second, "time [s]", "angle [degree]", angles,
           240);
      plot(std::string(file) + "-cart", figure_texts_.back().second, "time [s]", "cart [mm]", positions, 240);
    }
    say("");
    for (const auto& [file, title] : figure_texts_) {
      show(file, title);
      show(file.substr(0, 8) + "-cart", title);
    }
  }

  void saturation() {
    part("saturation");
    say("## The amplifier's limit makes the band of oscillation\n");
    say("Continuous delay, starts of 1, 3 and 5 degrees (a range where they differ). The paper's simulations "
        "name no "
        "limit: exponential friction falls from 0.041 s, dynamic from 0.028 s.\n");
    say("| limit [V] | exponential, gain (7): falls from [s] | dynamic, gain (10): falls from [s] "
        "|\n|---|---|---|");
    for (const double limit : {6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 15.0, 0.0}) {
      Case exponential, dynamic;
      dynamic.plant = dynamic.gains = "dynamic";
      exponential.limit_v = dynamic.limit_v = limit;
      say("| " + (limit > 0.0 ? number_text(limit) : std::string("none")) + " | " + falls_text(exponential) +
          " | " + falls_text(dynamic) + " |");
    }
    Case smooth;
    smooth.smoothing = paper_smoothing;
    say("\nWith tanh(100 v) in place of the sign and no limit the exponential model falls from " +
        falls_text(smooth) + " s.\n");
  }

  void basin_of_exponential() {
    part("figure 7");
    say("## Figure 7: exponential friction, gain (7)\n");
    Case c;
    std::vector<Series> all;
    add_transitions(c, "sign, no limit", 0, false, all);
    c.limit_v = 9.0;
    add_transitions(c, "sign, 9 V", 1, true, all);
    c.limit_v = 0.0;
    c.smoothing = paper_smoothing;
    add_transitions(c, "tanh(100 v), no limit", 2, false, all);
    basin("figure-7", "Figure 7: where the outcome changes, exponential friction", all, 0.1069);
    say("The dotted line is the critical delay of the linear analysis, 0.1069 s. Left of the dashed line of "
        "a colour the pendulum comes to rest (below 0.0016 rad), right of the full line it "
        "falls. Where the two coincide there is no band of oscillation.\n");
  }

  void basin_of_dynamic() {
    part("figure 8");
    say("## Figure 8: dynamic friction, gain (10)\n");
    Case c;
    c.plant = c.gains = "dynamic";
    std::vector<Series> all;
    add_transitions(c, "no limit", 0, true, all);
    c.limit_v = 9.0;
    add_transitions(c, "9 V", 1, true, all);
    basin("figure-8", "Figure 8: where the outcome changes, dynamic friction", all, 0.1072);
    say("The dotted line is the critical delay of the linear analysis with gain (10), 0.1072 s.\n");
  }

  void prediction() {
    part("the rig");
    say("## One plant with the rig's limits predicts the measured falls\n");
    say("`config/rigs/simulated.yaml`: amplifier " + number_text(rig_.amplifier.limit_v) +
        " V, velocity filter 50 Hz with damping 0.9, 1 kHz, 4096-count encoders; starts of 1, 3 and 5 "
        "degrees.\n");
    say("| gain | experiment falls from [s] | paper's model [s] | off | exponential plant here [s] | off | "
        "dynamic plant "
        "here [s] | off |\n|---|---|---|---|---|---|---|---|");
    rig_row("exponential", "(7)", 0.025, 0.041);
    rig_row("dynamic", "(10)", 0.023, 0.028);
    say("\n\"Off\" compares the middle of a range. The exponential plant is the one that predicts both.\n");
  }

  void rig_row(const std::string& gain, const std::string& name, double measured_s, double paper_s) {
    std::string row = "| " + name + " | " + number_text(measured_s) + " | " + number_text(paper_s) + " | " +
                      off(paper_s, measured_s);
    for (const char* model : {"exponential", "dynamic"}) {
      const Case c = on_rig(model, gain);
      const auto [low, high] = falls(c);
      row += " | " + range_text(low, high) + " | " + off(0.5 * (low + high), measured_s);
    }
    say(row + " |");
  }

  void effect_by_effect() {
    part("effect by effect");
    say("## How the gap closes, effect by effect\n");
    say("Falls from [s], starts of 1, 3 and 5 degrees, and how far that is from the experiment. Each line "
        "adds to the one "
        "above.\n");
    say("| model | exponential, gain (7) | off 0.025 | dynamic, gain (10) | off 0.023 "
        "|\n|---|---|---|---|---|");
    Case a, b;
    b.plant = b.gains = "dynamic";
    const auto line = [&](const std::string& name) {
      const auto [a_low, a_high] = falls(a);
      const auto [b_low, b_high] = falls(b);
      say("| " + name + " | " + range_text(a_low, a_high) + " | " + off(0.5 * (a_low + a_high), 0.025) +
          " | " + range_text(b_low, b_high) + " | " + off(0.5 * (b_low + b_high), 0.023) + " |");
    };
    const auto both = [&](auto change) {
      change(a);
      change(b);
    };
    line("the printed equations, continuous delay");
    both([this](Case& c) { c.limit_v = rig_.amplifier.limit_v; });
    line("+ amplifier limit " + number_text(rig_.amplifier.limit_v) + " V");
    both([](Case& c) { c.sampled = true, c.filter_hz = 2000.0; });
    line("+ sampling at 1 kHz, velocities nearly unfiltered (2 kHz)");
    both([](Case& c) { c.filter_hz = 50.0; });
    line("+ velocity filter 50 Hz");
    both([](Case& c) { c.encoders = true; });
    line("+ encoders");
    say("\nOne left out of the whole:\n");
    say("| left out | exponential, gain (7) | off 0.025 | dynamic, gain (10) | off 0.023 "
        "|\n|---|---|---|---|---|");
    const Case whole_a = a, whole_b = b;
    const auto without = [&](const std::string& name, auto change) {
      a = whole_a;
      b = whole_b;
      both(change);
      line(name);
    };
    without("nothing", [](Case&) {});
    without("amplifier limit", [](Case& c) { c.limit_v = 0.0; });
    without("velocity filter (2 kHz)", [](Case& c) { c.filter_hz = 2000.0; });
    without("encoders", [](Case& c) { c.encoders = false; });
    say("");
  }

  // What the parts above are made of.

  Plant plant(const std::string& name) const {
    return read_plant_file(options_.config / "plants" / (name + ".yaml"));
  }

  Case on_rig(const std::string& model, const std::string& gain) const {
    Case c;
    c.plant = model;
    c.gains = gain;
    c.limit_v = rig_.amplifier.limit_v;
    c.sampled = c.encoders = true;
    return c;
  }

  LoopSetup setup_of(const Case& c) const {
    LoopSetup setup;
    Plant with_limit = plant(c.plant);
    if (c.limit_v > 0.0) with_limit.set("voltage_saturation", {c.limit_v});
    setup.model = make_model<double>(with_limit);
    setup.model.smoothing = c.smoothing;
    setup.control = read_gain_file(options_.config / "gains" / (c.gains + ".yaml"));
    setup.control.estimator.cutoff_hz = c.filter_hz;
    setup.sampled = c.sampled;
    if (c.encoders) {
      setup.cart_resolution_m = rig_.calibration.cart.per_count;
      setup.angle_resolution_rad = rig_.calibration.pendulum.per_count;
    }
    return setup;
  }

  SweepConfig sweep_of(const Case& c, std::vector<double> theta0_rad, double longest_s) const {
    SweepConfig config;
    config.setup = setup_of(c);
    config.theta0_rad = std::move(theta0_rad);
    for (int i = 0; i <= static_cast<int>(std::lround(longest_s * 1e3)); ++i)
      config.delay_s.push_back(1e-3 * i);
    config.stable_below_rad = stable_below_rad;
    return config;
  }

  std::vector<Transition> transitions(const Case& c, std::vector<double> theta0_rad, double longest_s) const {
    const SweepConfig config = sweep_of(c, std::move(theta0_rad), longest_s);
    return find_transitions(config, *make_thread_team(config, options_.threads));
  }

  /// Smallest and largest delay from which 1, 3 and 5 degrees fall.
  std::pair<double, double> falls(const Case& c) const {
    double low = INFINITY, high = -INFINITY;
    for (const Transition& t : transitions(c, {1.0 * degree, 3.0 * degree, 5.0 * degree}, 0.1)) {
      low = std::min(low, t.falls_from_s);
      high = std::max(high, t.falls_from_s);
    }
    return {low, high};
  }

  std::string falls_text(const Case& c) const {
    const auto [low, high] = falls(c);
    return range_text(low, high);
  }

  static std::string range_text(double low, double high) {
    const auto text = [](double value) {
      char digits[32];
      std::snprintf(digits, sizeof digits, "%.4f", value);
      return std::string(digits);
    };
    return high - low < transition_tolerance_s ? text(low) : text(low) + " to " + text(high);
  }

  static std::string off(double value, double measured) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%+.0f %%", 100.0 * (value / measured - 1.0));
    return digits;
  }

  void add_transitions(const Case& c, const std::string& name, int color, bool rests,
                       std::vector<Series>& all) const {
    std::vector<double> angles;
    for (int i = 0; i <= 24; ++i) angles.push_back(0.01 * std::pow(1000.0, i / 24.0) * degree);
    Series falls_line, rests_line;
    falls_line.name = name + ": falls";
    rests_line.name = name + ": oscillates";
    falls_line.color = rests_line.color = color;
    rests_line.dashed = true;
    for (const Transition& t : transitions(c, angles, 0.12)) {
      falls_line.x.push_back(t.falls_from_s);
      falls_line.y.push_back(t.theta0_rad / degree);
      rests_line.x.push_back(t.oscillates_from_s);
      rests_line.y.push_back(t.theta0_rad / degree);
    }
    if (rests) all.push_back(rests_line);
    all.push_back(falls_line);
  }

  void basin(const std::string& file, const std::string& title, const std::vector<Series>& all,
             double linear_s) {
    Plot drawing;
    drawing.x.label = "delay [s]";
    drawing.x.low = 0.0;
    drawing.x.high = 0.12;
    drawing.y.label = "initial angle [degree]";
    drawing.y.logarithmic = true;
    drawing.series = all;
    drawing.vertical_marks = {{linear_s, "linear"}};
    drawing.height_px = 380;
    save("paper/" + file + ".svg", svg_of(drawing, "p"));
    show(file, title);
  }

  void plot(const std::string& file, const std::string& title, const std::string& x, const std::string& y,
            const std::vector<Series>& series, int height_px) {
    Plot drawing;
    drawing.title = title;
    drawing.x.label = x;
    drawing.y.label = y;
    drawing.series = series;
    drawing.height_px = height_px;
    save("paper/" + file + ".svg", svg_of(drawing, "p"));
  }

  void draw(const std::string& file, const std::string& title, const std::string& x, const std::string& y,
            const std::vector<Series>& series, int height_px) {
    plot(file, title, x, y, series, height_px);
    show(file, title);
  }

  void show(const std::string& file, const std::string& title) {
    say("![" + title + "](paper/" + file + ".svg)\n");
  }
  void say(const std::string& line) { text_ += line + "\n"; }
  void part(const std::string& name) const {
    if (options_.progress) options_.progress(name);
  }

  void save(const std::string& name, const std::string& content) const {
    std::ofstream out(folder_ / name, std::ios::binary);
    out << content;
    out.close();
    if (!out)
      throw Error(ExitCode::usage,
                  "check the folder and its free space: cannot write " + (folder_ / name).string());
  }

  std::filesystem::path folder_;
  const PaperOptions& options_;
  RigFile rig_;
  std::string text_;
  std::vector<std::pair<std::string, std::string>> figure_texts_;
};

}  // namespace

void write_paper(const std::filesystem::path& folder, const PaperOptions& options) {
  Paper(folder, options).write();
}

}  // namespace upright
