// The page of docs/paper.md as it grows, and what its parts are made of: the paper's plants and gains, its
// loop and the rig's, transitions over the delay, drawings.
#pragma once

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "design/delay_margin.hpp"
#include "paper.hpp"
#include "report/plot.hpp"
#include "sweep/sweep.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/elementary.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

inline constexpr double degree = std::numbers::pi / 180.0;
inline constexpr double paper_smoothing = 100.0;  // the paper's delta

/// The parts in their order, with the share of the whole time that was over when each began (measured, 63 s).
struct PaperPart {
  const char* name;
  double share_before;
};
inline constexpr PaperPart parts[] = {{"gains", 0.0},
                                      {"critical delays", 0.001},
                                      {"figures 3 and 5", 0.003},
                                      {"figures 2, 4 and 6", 0.012},
                                      {"the paper's simulations", 0.037},
                                      {"saturation", 0.054},
                                      {"figure 7", 0.12},
                                      {"figure 8", 0.14},
                                      {"the rig", 0.15},
                                      {"effect by effect", 0.20},
                                      {"compensation", 0.32},
                                      {"the quiet controller", 0.87}};
inline constexpr double stable_below_rad = 0.0016;

/// One way of looking at the loop: a plant, gains, and how much of the rig is in it.
struct PaperLoop {
  std::string plant = "exponential";
  std::string gains = "exponential";
  double limit_v = 0.0;  // 0: no limit
  double smoothing = 0.0;
  bool sampled = false;
  double filter_hz = 50.0;
  bool encoders = false;
};

/// Text and drawings in a folder.
class PaperPage {
 public:
  PaperPage(std::filesystem::path folder, const PaperOptions& options)
      : folder_(std::move(folder)),
        options_(options),
        rig_(read_rig_file(options.config / "rigs/simulated.yaml")) {
    std::error_code error;
    std::filesystem::create_directories(folder_ / "paper", error);
  }

 protected:
  Plant plant(const std::string& name) const {
    return read_plant_file(options_.config / "plants" / (name + ".yaml"));
  }

  Gains gains_of(const std::string& name) const {
    return read_gain_file(options_.config / "gains" / (name + ".yaml")).gains;
  }

  LoopMargin margin(const std::string& model, const Gains& gains) const {
    return continuous_margin(plant(model), gains, paper_smoothing);
  }

  static std::string seconds(double value_s) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.5f", value_s);
    return digits;
  }

  PaperLoop on_rig(const std::string& model, const std::string& gain) const {
    PaperLoop c;
    c.plant = model;
    c.gains = gain;
    c.limit_v = rig_.amplifier.limit_v;
    c.sampled = c.encoders = true;
    return c;
  }

  LoopSetup setup_of(const PaperLoop& c) const {
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

  SweepConfig sweep_of(const PaperLoop& c, std::vector<double> theta0_rad, double longest_s) const {
    SweepConfig config;
    config.engine = SweepEngine::reproducible;
    config.setup = setup_of(c);
    config.theta0_rad = std::move(theta0_rad);
    for (int i = 0; i <= static_cast<int>(std::lround(longest_s * 1e3)); ++i)
      config.delay_s.push_back(1e-3 * i);
    config.stable_below_rad = stable_below_rad;
    return config;
  }

  std::vector<Transition> transitions(const PaperLoop& c, std::vector<double> theta0_rad,
                                      double longest_s) const {
    const SweepConfig config = sweep_of(c, std::move(theta0_rad), longest_s);
    return find_transitions(config, *make_thread_executor(config, options_.threads));
  }

  static std::vector<double> rig_starts() { return {1.0 * degree, 3.0 * degree, 5.0 * degree}; }

  struct Interval {
    double low = INFINITY, high = -INFINITY;
    void include(double value) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  };
  /// Over some starts, the delays from which they oscillate and from which they fall.
  struct Changes {
    Interval oscillates, falls;
  };

  Changes changes(const PaperLoop& c, std::vector<double> starts,
                  double stable_rad = stable_below_rad) const {
    SweepConfig config = sweep_of(c, std::move(starts), 0.1);
    config.stable_below_rad = stable_rad;
    Changes found;
    for (const Transition& t : find_transitions(config, *make_thread_executor(config, options_.threads))) {
      found.oscillates.include(t.oscillates_from_s);
      found.falls.include(t.falls_from_s);
    }
    return found;
  }

  /// Smallest and largest delay from which 1, 3 and 5 degrees fall.
  std::pair<double, double> falls(const PaperLoop& c) const {
    const Interval found = changes(c, rig_starts()).falls;
    return {found.low, found.high};
  }

  static std::string text_of(const Interval& interval) { return range_text(interval.low, interval.high); }

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

  void add_transitions(const PaperLoop& c, const std::string& name, std::size_t color, bool rests,
                       std::vector<Series>& all) const {
    std::vector<double> angles;
    for (int i = 0; i <= 24; ++i) angles.push_back(0.01 * elementary::power(1000.0, i / 24.0) * degree);
    Series falls_line, rests_line;
    falls_line.name = name + ": falls";
    rests_line.name = name + ": oscillates";
    falls_line.color = rests_line.color = color::curve(color);
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

  /// A drawing whose texts are legible on the page in a narrow window too.
  static Plot on_page() {
    Plot drawing;
    drawing.width_px = 560;
    drawing.text_px = 14;
    return drawing;
  }

  void basin(const std::string& file, const std::string& title, const std::vector<Series>& all,
             double linear_s) {
    Plot drawing = on_page();
    drawing.x.label = "delay [s]";
    drawing.x.low = 0.0;
    drawing.x.high = 0.12;
    drawing.y.label = "initial angle [degree]";
    drawing.y.logarithmic = true;
    drawing.series = all;
    drawing.vertical_marks = {{linear_s, "linear"}};
    drawing.height_px = 380;
    save("paper/" + file + ".svg", svg_file_of(drawing));
    show(file, title);
  }

  void plot(const std::string& file, const std::string& title, const std::string& x, const std::string& y,
            const std::vector<Series>& series, int height_px) {
    Plot drawing = on_page();
    drawing.title = title;
    drawing.x.label = x;
    drawing.y.label = y;
    drawing.series = series;
    drawing.height_px = height_px;
    save("paper/" + file + ".svg", svg_file_of(drawing));
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
    if (!options_.progress) return;
    for (const PaperPart& one : parts)
      if (name == one.name) options_.progress(one.share_before, name);
  }

  void save(const std::string& name, const std::string& content) const {
    std::ofstream out(folder_ / name, std::ios::binary);
    out << content;
    out.close();
    if (!out)
      throw Error(ExitCode::usage,
                  "cannot write " + (folder_ / name).string() + ": check the folder and its free space");
  }

  std::filesystem::path folder_;
  const PaperOptions& options_;
  RigFile rig_;
  std::string text_;
};

}  // namespace upright
