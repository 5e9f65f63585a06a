#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>

#include "base/angle_units.hpp"
#include "base/yaml_keys.hpp"
#include "control/filter_model.hpp"
#include "sweep.hpp"
#include "upright/base/error.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/elementary.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

constexpr std::int64_t max_values = 1'000'000;
constexpr double max_runs = 1e8, max_plant_runs = 1e9;

/// The decimal number that is meant: 0.12 * 7 / 120 is 0.007 and not the sum of its roundings.
double rounded(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.15g", value);
  return std::strtod(text, nullptr);
}

/// The values of {from, to, count}.
std::vector<double> spaced_keys(YamlKeys& keys, const Range& range) {
  constexpr Words<2> spacings = {"linear", "log"};
  double from = 0.0, to = 0.0;
  std::int64_t count = 0;
  bool logarithmic = false;
  keys.number("from", from, range);
  keys.number("to", to, range);
  keys.integer("count", count, 1, max_values);
  keys.one_of("spacing", logarithmic, spacings, false);
  if (const YamlMap* map = keys.source()) map->finish();
  keys.check("to", count <= 1 || to > from, "is not above from", "set it to more than " + exact_text(from));
  keys.check("count", count != 1 || to == from, "is 1, but from and to differ", "set it to at least 2");
  keys.check("from", !logarithmic || from > 0.0, "must be above 0 for spacing: log",
             "set it to more than 0, or use spacing: linear");
  std::vector<double> values;
  if (!keys.source()) return values;
  for (std::int64_t i = 0; i < count; ++i) {
    const double part = count > 1 ? static_cast<double>(i) / static_cast<double>(count - 1) : 0.0;
    values.push_back(
        rounded(logarithmic ? from * elementary::power(to / from, part) : from + (to - from) * part));
  }
  return values;
}

void grid_key(YamlKeys& keys, const char* key, std::vector<double>& values, const Range& range) {
  if (keys.is_map(key, false))
    return keys.map(key, [&](YamlKeys& grid) { values = spaced_keys(grid, range); });
  keys.numbers(key, values, range);
  keys.check_size(key, values.size(), 1, any_size, "is empty",
                  "write at least one value, or {from, to, count}");
}

void delay_key(YamlKeys& keys, std::vector<double>& delays) {
  grid_key(keys, "delay_s", delays, Range::within(0.0, DelayLine::longest_delay_s));
  for (std::size_t i = 1; i < delays.size(); ++i)
    keys.check("delay_s", delays[i] > delays[i - 1],
               "is not increasing: " + exact_text(delays[i]) + " follows " + exact_text(delays[i - 1]),
               "sort the delays and list each once");
}

void angle_key(YamlKeys& keys, std::vector<double>& angles, double fell_above_rad) {
  grid_key(keys, "theta0_deg", angles, Range::within(-180.0, 180.0));
  for (double& angle : angles) {
    const double degrees = angle;
    angle *= radians_per_degree;
    keys.check("theta0_deg", std::abs(angle) < fell_above_rad,
               "contains " + exact_text(degrees) + " degrees, which counts as fallen",
               "keep every angle below outcome.fell_above_rad = " + exact_text(fell_above_rad));
  }
  for (std::size_t i = 1; i < angles.size(); ++i)
    keys.check("theta0_deg", angles[i] > angles[i - 1], "is not increasing",
               "sort the angles and list each once");
}

/// Sets what the rig decides, and returns it as text.
std::string take_rig(const std::filesystem::path& file, LoopSetup& setup) {
  const RigFile rig = read_rig_file(file);
  const bool steps = !rig.simulated || rig.simulated->quantise;
  setup.cart_resolution_m = steps ? rig.calibration.cart.per_count : 0.0;
  setup.angle_resolution_rad = steps ? rig.calibration.pendulum.per_count : 0.0;
  setup.amplifier_limit_v = rig.amplifier.limit_v;
  setup.control =
      with_encoders(setup.control, rig.calibration.cart.per_count, rig.calibration.pendulum.per_count);
  return "  # rig: cart step " + exact_text(setup.cart_resolution_m) + " m, angle step " +
         exact_text(setup.angle_resolution_rad) + " rad, amplifier " + exact_text(setup.amplifier_limit_v) +
         " V\n";
}

std::string list_text(const std::string& key, const std::vector<double>& values) {
  std::string text = "  " + key + ": [";
  for (std::size_t i = 0; i < values.size(); ++i) text += (i == 0 ? "" : ", ") + exact_text(values[i]);
  return text + "]\n";
}

void outcome_keys(YamlKeys& keys, SweepConfig& config) {
  keys.number("stable_below_rad", config.stable_below_rad, Range::positive());
  keys.number("fell_above_rad", config.setup.fell_above_rad, Range{0.0, std::numbers::pi, true});
  if (const YamlMap* map = keys.source()) map->finish();
  keys.check("fell_above_rad", config.setup.fell_above_rad > config.stable_below_rad,
             "is not above stable_below_rad", "set it to more than " + exact_text(config.stable_below_rad));
}

/// Gives sampled loops the estimator and the predictor that the gain file asks for; returns their plant
/// files' text, or nothing.
std::string take_model_parts(const YamlMap& map, LoopSetup& setup) {
  const ControlConfig& control = setup.control;
  const bool predicts = control.compensation.kind != CompensationKind::none;
  const bool estimates = control.has_state_estimator();
  if (!predicts && !estimates) return "";
  if (!setup.sampled)
    map.fail("loop",
             std::string("is continuous, but ") + (predicts ? "delay_compensation" : "state_estimator") +
                 " of the gain file needs a sampled loop",
             "use loop: sampled");
  const Plant predicted = predicts ? read_plant_file(control.compensation.plant) : Plant{};
  const Plant estimated = estimates ? read_plant_file(control.state_estimator.plant) : Plant{};
  setup.make_parts = [estimated, predicted](const ControlConfig& asked) {
    return make_model_parts(asked, estimated, predicted);
  };
  return (predicts ? "# The predictor's plant file:\n" + plant_text(predicted) : std::string()) +
         (estimates ? "# The estimator's plant file:\n" + plant_text(estimated) : std::string());
}

constexpr Words<2> loops = {"continuous", "sampled"};
constexpr Words<3> engines = {"fast", "reproducible", "reference"};

/// What other files say, as the resolved text shows it.
struct NamedFiles {
  std::string rig, model_parts;
};

void take_plant(const YamlMap& map, SweepConfig& config) {
  config.plant = read_plant_file(config.plant_file);
  if (!config.plant.pendulum) map.fail("plant", "has no pendulum", "name a plant file with one");
  config.setup.model = make_model<double>(config.plant);
}

/// The files that a sweep names are read as soon as their keys are.
void file_keys(YamlKeys& keys, SweepConfig& config, NamedFiles& files) {
  const YamlMap* map = keys.source();
  std::filesystem::path rig;
  LoopSetup& setup = config.setup;
  keys.path("plant", config.plant_file);
  if (map) take_plant(*map, config);
  keys.path("gains", config.gain_file);
  if (map) setup.control = read_gain_file(config.gain_file);
  keys.one_of("loop", setup.sampled, loops);
  if (setup.sampled) {
    keys.path("rig", rig);
    if (map) files.rig = take_rig(rig, setup);
  } else {
    keys.needs("rig", !keys.decides_by_presence("rig", false), "is valid for sampled loops only",
               "remove it, or use loop: sampled");
  }
  if (map) files.model_parts = take_model_parts(*map, setup);
}

void sweep_keys(YamlKeys& keys, SweepConfig& config, NamedFiles& files) {
  LoopSetup& setup = config.setup;
  file_keys(keys, config, files);
  keys.map("outcome", [&config](YamlKeys& outcome) { outcome_keys(outcome, config); });
  angle_key(keys, config.theta0_rad, setup.fell_above_rad);
  delay_key(keys, config.delay_s);
  const double runs =
      static_cast<double>(config.theta0_rad.size()) * static_cast<double>(config.delay_s.size());
  keys.check("theta0_deg", runs <= max_runs, "and delay_s together make too many runs",
             "use fewer values, for at most 1e8 runs");
  keys.number("duration_s", setup.duration_s, Range{0.0, 1e5, true});
  keys.one_of("engine", config.engine, engines);
  keys.number("smoothing", setup.model.smoothing, Range::not_negative(), 0.0);
  keys.optional_map("uncertainty", config.uncertainty, [&config](YamlKeys& inner, Uncertainty& uncertainty) {
    uncertainty_keys(inner, uncertainty, config.plant);
  });
  const double samples = config.uncertainty ? config.uncertainty->samples : 0.0;
  keys.check("uncertainty", runs * samples <= max_plant_runs,
             "with theta0_deg and delay_s makes too many runs",
             "use fewer samples, angles or delays, for at most 1e9 runs");
}

}  // namespace

void sweep_keys(YamlKeys& document, SweepConfig& config) {
  NamedFiles none;
  document.map("sweep", [&](YamlKeys& keys) { sweep_keys(keys, config, none); });
}

SweepConfig read_sweep_file(const std::filesystem::path& file) {
  const YamlMap document = YamlMap::from_file(file);
  const YamlMap map = document.map("sweep");
  document.finish();
  SweepConfig config;
  NamedFiles files;
  YamlKeyReader reader(map);
  sweep_keys(reader, config, files);
  map.finish();
  const LoopSetup& setup = config.setup;
  config.resolved_text =
      "sweep:\n  loop: " + std::string(setup.sampled ? "sampled" : "continuous") + "\n" + files.rig +
      list_text("theta0_rad", config.theta0_rad) + list_text("delay_s", config.delay_s) +
      "  duration_s: " + exact_text(setup.duration_s) +
      "\n  outcome: {stable_below_rad: " + exact_text(config.stable_below_rad) +
      ", fell_above_rad: " + exact_text(setup.fell_above_rad) +
      "}\n  engine: " + engines[static_cast<std::size_t>(config.engine)] +
      "\n  smoothing: " + exact_text(setup.model.smoothing) + "\n" +
      (config.uncertainty ? config.uncertainty->text() : std::string()) + "# The plant file:\n" +
      plant_text(config.plant) + "# The gain file:\n" + gain_text(setup.control) + files.model_parts;
  return config;
}

}  // namespace upright
