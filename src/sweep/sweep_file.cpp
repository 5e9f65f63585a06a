#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>

#include "base/angle_units.hpp"
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
constexpr double max_runs = 1e8;

/// The decimal number that is meant: 0.12 * 7 / 120 is 0.007 and not the sum of its roundings.
double rounded(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.15g", value);
  return std::strtod(text, nullptr);
}

std::vector<double> spaced(const YamlMap& map, const Range& range) {
  const double from = map.number("from", range), to = map.number("to", range);
  const auto count = map.integer("count", 1, max_values);
  const bool logarithmic = map.has("spacing") && map.choice("spacing", {"linear", "log"}) == "log";
  map.finish();
  if (count > 1 && !(to > from))
    map.fail("to", "is not above from", "set it to more than " + exact_text(from));
  if (count == 1 && to != from) map.fail("count", "is 1, but from and to differ", "set it to at least 2");
  if (logarithmic && !(from > 0.0))
    map.fail("from", "must be above 0 for spacing: log", "set it to more than 0, or use spacing: linear");
  std::vector<double> values;
  for (std::int64_t i = 0; i < count; ++i) {
    const double part = count > 1 ? static_cast<double>(i) / static_cast<double>(count - 1) : 0.0;
    values.push_back(
        rounded(logarithmic ? from * elementary::power(to / from, part) : from + (to - from) * part));
  }
  return values;
}

std::vector<double> read_grid(const YamlMap& map, const std::string& key, const Range& range) {
  if (map.is_map(key)) return spaced(map.map(key), range);
  std::vector<double> values = map.numbers(key, range);
  if (values.empty()) map.fail(key, "is empty", "write at least one value, or {from, to, count}");
  return values;
}

std::vector<double> read_delays(const YamlMap& map) {
  std::vector<double> delays = read_grid(map, "delay_s", Range::within(0.0, DelayLine::longest_delay_s));
  for (std::size_t i = 1; i < delays.size(); ++i)
    if (!(delays[i] > delays[i - 1]))
      map.fail("delay_s",
               "is not increasing: " + exact_text(delays[i]) + " follows " + exact_text(delays[i - 1]),
               "sort the delays and list each once");
  return delays;
}

std::vector<double> read_angles(const YamlMap& map, double fell_above_rad) {
  std::vector<double> angles = read_grid(map, "theta0_deg", Range::within(-180.0, 180.0));
  for (double& angle : angles) {
    const double degrees = angle;
    angle *= radians_per_degree;
    if (std::abs(angle) >= fell_above_rad)
      map.fail("theta0_deg", "contains " + exact_text(degrees) + " degrees, which counts as fallen",
               "keep every angle below outcome.fell_above_rad = " + exact_text(fell_above_rad));
  }
  for (std::size_t i = 1; i < angles.size(); ++i)
    if (!(angles[i] > angles[i - 1]))
      map.fail("theta0_deg", "is not increasing", "sort the angles and list each once");
  return angles;
}

/// Sets what the rig decides, and returns it as text.
std::string take_rig(const YamlMap& map, LoopSetup& setup) {
  const RigFile rig = read_rig_file(map.path("rig"));
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

void read_outcome(const YamlMap& map, SweepConfig& config) {
  const YamlMap outcome = map.map("outcome");
  config.stable_below_rad = outcome.number("stable_below_rad", Range::positive());
  config.setup.fell_above_rad = outcome.number("fell_above_rad", Range{0.0, std::numbers::pi, true});
  outcome.finish();
  if (!(config.setup.fell_above_rad > config.stable_below_rad))
    outcome.fail("fell_above_rad", "is not above stable_below_rad",
                 "set it to more than " + exact_text(config.stable_below_rad));
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

}  // namespace

SweepConfig read_sweep_file(const std::filesystem::path& file) {
  const YamlMap document = YamlMap::from_file(file);
  const YamlMap map = document.map("sweep");
  document.finish();
  SweepConfig config;
  LoopSetup& setup = config.setup;
  const Plant plant = read_plant_file(map.path("plant"));
  if (!plant.pendulum) map.fail("plant", "has no pendulum", "name a plant file with one");
  setup.control = read_gain_file(map.path("gains"));
  setup.sampled = map.choice("loop", {"continuous", "sampled"}) == "sampled";
  if (!setup.sampled && map.has("rig"))
    map.fail("rig", "is valid for sampled loops only", "remove it, or use loop: sampled");
  const std::string rig = setup.sampled ? take_rig(map, setup) : std::string();
  const std::string compensation = take_model_parts(map, setup);
  read_outcome(map, config);
  config.theta0_rad = read_angles(map, setup.fell_above_rad);
  config.delay_s = read_delays(map);
  const double runs =
      static_cast<double>(config.theta0_rad.size()) * static_cast<double>(config.delay_s.size());
  if (runs > max_runs)
    map.fail("theta0_deg", "and delay_s together make too many runs",
             "use fewer values, for at most 1e8 runs");
  setup.duration_s = map.number("duration_s", Range{0.0, 1e5, true});
  const std::string engine = map.choice("engine", {"fast", "reproducible", "reference"});
  config.engine = engine == "fast"           ? SweepEngine::fast
                  : engine == "reproducible" ? SweepEngine::reproducible
                                             : SweepEngine::reference;
  setup.model = make_model<double>(plant);
  config.plant = plant;
  config.plant_file = map.path("plant");
  setup.model.smoothing = map.number_or("smoothing", 0.0, Range::not_negative());
  map.finish();

  config.resolved_text = "sweep:\n  loop: " + std::string(setup.sampled ? "sampled" : "continuous") + "\n" +
                         rig + list_text("theta0_rad", config.theta0_rad) +
                         list_text("delay_s", config.delay_s) +
                         "  duration_s: " + exact_text(setup.duration_s) +
                         "\n  outcome: {stable_below_rad: " + exact_text(config.stable_below_rad) +
                         ", fell_above_rad: " + exact_text(setup.fell_above_rad) + "}\n  engine: " + engine +
                         "\n  smoothing: " + exact_text(setup.model.smoothing) + "\n# The plant file:\n" +
                         plant_text(plant) + "# The gain file:\n" + gain_text(setup.control) + compensation;
  return config;
}

}  // namespace upright
