#include "upright/report/experiment_report.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "upright/analysis/delay_margin.hpp"
#include "upright/analysis/sweep.hpp"
#include "upright/control/predictor.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/report/html.hpp"
#include "upright/report/plot.hpp"
#include "upright/runtime/experiment.hpp"

namespace upright {

namespace {

constexpr double per_degree = 180.0 / std::numbers::pi;
const char* const outcomes[] = {"stable", "oscillating", "fell"};

/// A folder read back: its pieces and trials.
struct Record {
  std::string name;
  std::vector<Piece> pieces;
  std::vector<TrialResult> trials;
};

Record read_record(const std::filesystem::path& folder) {
  const YamlMap document = YamlMap::from_file(folder / "experiment.yaml");
  Record record;
  record.name = document.text("name");
  for (const YamlMap& piece : document.maps("pieces")) record.pieces.push_back(read_piece(piece));
  record.trials = read_trials(folder);
  return record;
}

std::string milliseconds(double seconds) {
  return std::isfinite(seconds) ? number_text(1e3 * seconds, 4) : "-";
}

/// The rig's loop in simulation, over the same delays and a little finer.
std::vector<SweepRun> simulate(const Plant& plant, const RunRecord& run,
                               const std::vector<TrialResult>& trials, double duration_s) {
  SweepConfig config;
  config.setup.model = make_model<double>(plant);
  config.setup.control = run.control;
  config.setup.sampled = true;
  config.setup.cart_resolution_m = run.rig.calibration.cart.per_count;
  config.setup.angle_resolution_rad = run.rig.calibration.pendulum.per_count;
  config.setup.amplifier_limit_v = run.rig.amplifier.limit_v;
  config.setup.duration_s = duration_s;
  config.setup.fell_above_rad = run.rig.fall_angle_rad;
  if (run.control.compensation.kind != CompensationKind::none)
    config.setup.make_compensator = [&plant](const ControlConfig& control, double) {
      return std::make_unique<Predictor>(control, plant);
    };
  double theta0 = 0.0, longest = 0.0;
  for (const TrialResult& r : trials) {
    theta0 += std::abs(r.theta0_rad) / static_cast<double>(trials.size());
    longest = std::max(longest, r.trial.delay_s);
  }
  SweepTeam::Group cases;
  constexpr int count = 60;
  for (int i = 0; i <= count; ++i) cases.push_back({theta0, 1.2 * longest * i / count});
  std::vector<SweepRun> runs;
  const std::size_t most = std::max<std::size_t>(1, sweep_group_size(config));
  for (std::size_t begin = 0; begin < cases.size(); begin += most) {
    const SweepTeam::Group group(
        cases.begin() + static_cast<std::ptrdiff_t>(begin),
        cases.begin() + static_cast<std::ptrdiff_t>(std::min(begin + most, cases.size())));
    const std::vector<SweepRun> done = run_sweep_group(config, group);
    runs.insert(runs.end(), done.begin(), done.end());
  }
  return runs;
}

/// From where on and until where: over the repeats.
std::string spread(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return "-";
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *low == *high ? milliseconds(*low) : milliseconds(*low) + " to " + milliseconds(*high);
}

double first_of(const std::vector<TrialResult>& trials, int repeat, bool fall) {
  double first = std::nan("");
  for (const TrialResult& r : trials)
    if (r.trial.repeat == repeat && (r.outcome == "fell" || (!fall && r.outcome == "oscillating")) &&
        !(first < r.trial.delay_s))
      first = r.trial.delay_s;
  return first;
}

void add_sweep(HtmlPage& page, const std::filesystem::path& folder, const Piece& piece,
               const std::vector<TrialResult>& trials) {
  const RunRecord run = read_run_without_samples(folder / trials.front().run_directory);
  const Plant plant = read_plant_file(folder / "plan_plant.yaml");
  const std::vector<SweepRun> simulated = simulate(plant, run, trials, piece.duration_s);
  Plot plot;
  plot.title = "Amplitude over delay";
  plot.x.label = "delay [ms]";
  plot.y.label = "angle amplitude [degree]";
  plot.y.logarithmic = true;
  plot.height_px = 400;
  constexpr double least_degree = 1e-3;
  Series line{"simulated", {}, {}};
  double simulated_oscillates = std::nan(""), simulated_falls = std::nan("");
  for (const SweepRun& r : simulated) {
    line.x.push_back(1e3 * r.start.delay_s);
    line.y.push_back(std::max(r.theta_amplitude_rad * per_degree, least_degree));
    const Outcome outcome = r.outcome(piece.stable_below_rad);
    if (outcome != Outcome::stable && std::isnan(simulated_oscillates))
      simulated_oscillates = r.start.delay_s;
    if (outcome == Outcome::fell && std::isnan(simulated_falls)) simulated_falls = r.start.delay_s;
  }
  plot.series.push_back(line);
  for (const char* outcome : outcomes) {
    Series points{std::string("rig, ") + outcome, {}, {}, Series::Style::points};
    for (const TrialResult& r : trials)
      if (r.outcome == outcome) {
        points.x.push_back(1e3 * r.trial.delay_s);
        points.y.push_back(std::max(r.theta_amplitude_rad * per_degree, least_degree));
      }
    if (!points.x.empty()) plot.series.push_back(points);
  }
  ControlConfig control = run.control;
  control.delay_s = 0.0;
  constexpr double smoothing = 100.0;
  const LoopMargin margin = continuous_margin(plant, control.gains, smoothing);
  Plant sliding = plant;
  for (const char* dry : {"coulomb_friction", "stribeck_friction", "bristle_friction", "friction_asymmetry",
                          "position_dependent_friction"})
    sliding.remove(effect_number(dry));
  const LoopMargin sliding_margin = continuous_margin(sliding, control.gains, smoothing);
  const auto mark = [&](const LoopMargin& m, const char* words) {
    if (m.critical_delay_s > 0.0 && std::isfinite(m.critical_delay_s))
      plot.vertical_marks.push_back({1e3 * m.critical_delay_s, words});
  };
  mark(margin, "linear, near rest");
  mark(sliding_margin, "linear, sliding");
  page.section("Delay sweep " + piece.label);
  page.figure(plot,
              "The rig's runs (points) over a simulated sweep of the same loop (line). Vertical: the "
              "critical delay of the linear analysis.");
  std::vector<double> oscillates, falls;
  for (int repeat = 0; repeat < piece.repeats; ++repeat) {
    oscillates.push_back(first_of(trials, repeat, false));
    falls.push_back(first_of(trials, repeat, true));
  }
  page.table({{"", "oscillates from [ms]", "falls from [ms]"},
              {{"rig, over its repeats", spread(oscillates), spread(falls)},
               {"simulated", milliseconds(simulated_oscillates), milliseconds(simulated_falls)},
               {"linear, near rest", "-", milliseconds(margin.critical_delay_s)},
               {"linear, while the cart slides", "-", milliseconds(sliding_margin.critical_delay_s)}},
              "An amplitude below " + number_text(piece.stable_below_rad * per_degree, 3) +
                  " degree counts as stable."});
}

}  // namespace

bool is_experiment_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "experiment.yaml", ignored) &&
         std::filesystem::exists(folder / "trials.csv", ignored);
}

std::filesystem::path write_experiment_report(const std::filesystem::path& folder) {
  const Record record = read_record(folder);
  if (record.trials.empty())
    throw ConfigError("give the experiment command again: " + folder.string() + " holds no finished run");
  HtmlPage page("Experiment " + record.name, folder.string());
  const bool complete = !next_trial(record.pieces, record.trials);
  page.answer(complete ? Tone::good : Tone::warning, complete ? "Complete" : "Not complete",
              std::to_string(record.trials.size()) + " runs.");
  for (std::size_t i = 0; i < record.pieces.size(); ++i) {
    std::vector<TrialResult> trials;
    for (const TrialResult& r : record.trials)
      if (r.trial.piece == i) trials.push_back(r);
    if (!trials.empty() && record.pieces[i].kind == PieceKind::delay_sweep)
      add_sweep(page, folder, record.pieces[i], trials);
  }
  page.section("Runs");
  HtmlTable table{{"run directory", "delay [ms]", "outcome", "start [degree]", "angle [degree]", "cart [mm]",
                   "frequency [Hz]"},
                  {},
                  "Each replays and has a report of its own."};
  for (const TrialResult& r : record.trials)
    table.rows.push_back(
        {r.run_directory, milliseconds(r.trial.delay_s), r.outcome, number_text(r.theta0_rad * per_degree, 3),
         number_text(r.theta_amplitude_rad * per_degree, 3), number_text(1e3 * r.cart_amplitude_m, 3),
         std::isfinite(r.frequency_hz) ? number_text(r.frequency_hz, 3) : "-"});
  page.table(table);
  const std::filesystem::path file = folder / "report.html";
  page.write(file);
  return file;
}

}  // namespace upright
