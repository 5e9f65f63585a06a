#include "experiment_report.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/angle_units.hpp"
#include "base/parallel.hpp"
#include "comparison/paired_comparison.hpp"
#include "design/delay_margin.hpp"
#include "experiment/experiment.hpp"
#include "experiment/pieces/delay_sweep.hpp"
#include "experiment/pieces/free_decay.hpp"
#include "html.hpp"
#include "model/linear_plant.hpp"
#include "paired_report.hpp"
#include "plot.hpp"
#include "result_text.hpp"
#include "run_data.hpp"
#include "run_report.hpp"
#include "sweep/sweep.hpp"
#include "upright/base/error.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

/// The pieces and trials of an experiment folder.
struct Record {
  std::string name;
  std::vector<Piece> pieces;
  std::vector<TrialResult> trials;
  std::vector<std::string> links;     ///< to the report of each trial; empty if the run cannot be read
  std::vector<std::string> problems;  ///< why runs cannot be read
};

Record read_record(const std::filesystem::path& folder) {
  const YamlMap document = YamlMap::from_file(folder / "experiment.yaml");
  Record record;
  record.name = document.text("name");
  for (const YamlMap& piece : document.maps("pieces")) record.pieces.push_back(read_piece(piece));
  record.trials = read_trials(folder, record.pieces);
  return record;
}

/// The rig's loop in simulation, for the delays of the experiment and some between them.
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
  if (run.control.compensation.kind != CompensationKind::none || run.control.has_state_estimator())
    config.setup.make_parts = [&plant](const ControlConfig& control) {
      return make_model_parts(control, plant, plant);
    };
  double theta0 = 0.0, longest = 0.0;
  for (const TrialResult& r : trials) {
    theta0 += std::abs(r.theta0_rad) / static_cast<double>(trials.size());
    longest = std::max(longest, r.trial.delay_s);
  }
  std::vector<LoopCase> cases;
  constexpr int count = 60;
  const double drawn_to_s = std::min(1.2 * longest, DelayLine::longest_delay_s);
  for (int i = 0; i <= count; ++i) cases.push_back({theta0, drawn_to_s * i / count});
  std::vector<SweepRun> runs;
  const std::size_t group_size = std::max<std::size_t>(1, sweep_group_size(config));
  for (std::size_t begin = 0; begin < cases.size(); begin += group_size) {
    const std::vector<LoopCase> group(
        cases.begin() + static_cast<std::ptrdiff_t>(begin),
        cases.begin() + static_cast<std::ptrdiff_t>(std::min(begin + group_size, cases.size())));
    const std::vector<SweepRun> done = run_sweep_group(config, group);
    runs.insert(runs.end(), done.begin(), done.end());
  }
  return runs;
}

/// The range of a transition over the repeats.
std::string spread(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return "-";
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *low == *high ? milliseconds(*low) : milliseconds(*low) + " to " + milliseconds(*high);
}

/// A simulated sweep and the linear analysis of the plant of the plan.
struct SweepModel {
  std::vector<SweepRun> simulated;
  LoopMargin margin, sliding_margin;
};

SweepModel sweep_model(const Plant& plant, const RunRecord& run, const std::vector<TrialResult>& trials,
                       double duration_s) {
  constexpr double smoothing = 100.0;
  return {simulate(plant, run, trials, duration_s), continuous_margin(plant, run.control.gains, smoothing),
          continuous_margin(sliding_plant(plant), run.control.gains, smoothing)};
}

/// The same with plant and gains from files. An error names the files that cannot be analysed.
SweepModel sweep_model(const std::filesystem::path& folder, const std::vector<TrialResult>& trials,
                       double duration_s) {
  const std::filesystem::path plant_file = folder / "plan_plant.yaml";
  const std::filesystem::path run_folder = folder / trials.front().run_directory;
  const RunRecord run = read_run_without_samples(run_folder);
  const Plant plant = read_plant_file(plant_file);
  try {
    return sweep_model(plant, run, trials, duration_s);
  } catch (const ConfigError& error) {
    throw ConfigError(plant_file.string() + " with the gains of " + (run_folder / "run.yaml").string() +
                      ": " + error.what());
  }
}

void add_sweep(HtmlPage& page, const std::filesystem::path& folder, const std::string& label,
               const pieces::DelaySweep& sweep, const std::vector<TrialResult>& trials) {
  const auto [simulated, margin, sliding_margin] = sweep_model(folder, trials, sweep.duration_s);
  Plot plot;
  plot.title = "Amplitude over delay";
  plot.x.label = "delay [ms]";
  plot.y.label = "angle amplitude [degree]";
  plot.y.logarithmic = true;
  plot.height_px = 400;
  constexpr double min_degree = 1e-3;
  Series line{"simulated", {}, {}, Series::Style::line, color::soft};
  double simulated_oscillates = std::nan(""), simulated_falls = std::nan("");
  for (const SweepRun& r : simulated) {
    line.x.push_back(1e3 * r.start.delay_s);
    line.y.push_back(std::max(r.theta_amplitude_rad * degrees_per_radian, min_degree));
    const Outcome outcome = r.outcome(sweep.stable_below_rad);
    if (outcome != Outcome::stable && std::isnan(simulated_oscillates))
      simulated_oscillates = r.start.delay_s;
    if (outcome == Outcome::fell && std::isnan(simulated_falls)) simulated_falls = r.start.delay_s;
  }
  plot.series.push_back(line);
  for (const std::string& outcome : outcome_names) {
    Series points{std::string("rig, ") + outcome, {}, {}, Series::Style::points, color::of_outcome(outcome)};
    for (const TrialResult& r : trials)
      if (r.outcome == outcome) {
        points.x.push_back(1e3 * r.trial.delay_s);
        points.y.push_back(std::max(r.theta_amplitude_rad * degrees_per_radian, min_degree));
      }
    if (!points.x.empty()) plot.series.push_back(points);
  }
  const auto mark = [&](const LoopMargin& m, const char* words) {
    if (m.critical_delay_s > 0.0 && std::isfinite(m.critical_delay_s))
      plot.vertical_marks.push_back({1e3 * m.critical_delay_s, words});
  };
  mark(margin, "linear, near rest");
  mark(sliding_margin, "linear, sliding");
  page.section(label == pieces::DelaySweep::kind ? "Delay sweep" : "Delay sweep " + label);
  page.figure(
      plot,
      "Points: runs on the rig. Line: simulation of the same loop. Vertical lines: critical delay of the "
      "linear analysis.");
  std::vector<double> oscillates, falls;
  for (int repeat = 0; repeat < sweep.repeats; ++repeat) {
    const std::vector<TrialResult> results = pieces::of_repeat(trials, trials.front().trial.piece, repeat);
    oscillates.push_back(pieces::oscillates_from_s(results));
    falls.push_back(pieces::falls_from_s(results));
  }
  page.table({{"", "oscillates from [ms]", "falls from [ms]"},
              {{"rig, range over repeats", spread(oscillates), spread(falls)},
               {"simulated", milliseconds(simulated_oscillates), milliseconds(simulated_falls)},
               {"linear, near rest", "-", milliseconds(margin.critical_delay_s)},
               {"linear, while the cart slides", "-", milliseconds(sliding_margin.critical_delay_s)}},
              "An amplitude below " + number_text(sweep.stable_below_rad * degrees_per_radian, 3) +
                  " degree counts as stable."});
}

/// Writes the report of each run and stores the link to it.
void write_run_reports(const std::filesystem::path& folder, Record& record) {
  record.links.assign(record.trials.size(), "");
  std::vector<std::string> problems(record.trials.size());
  parallel_for(record.trials.size(), [&](std::size_t i) {
    const std::string& run = record.trials[i].run_directory;
    try {
      write_run_report(folder / run);
      record.links[i] = link_to(std::filesystem::path(run) / "report.html");
    } catch (const Error& error) {
      problems[i] = run + " has no report because it cannot be read: " + error.what();
    }
  });
  for (const std::string& problem : problems)
    if (!problem.empty()) record.problems.push_back(problem);
}

/// Small plots of a run: the quantities that its piece is about.
std::vector<Plot> small_plots(const RunData& run, const Piece& piece, const TrialResult& trial,
                              const std::string& link) {
  Plot first, second;
  Series theta, cart, voltage;
  voltage.style = Series::Style::steps;
  for (const LogRecord& row : run.drawn) {
    const double time_s = 1e-9 * static_cast<double>(row.time_ns);
    for (Series* series : {&theta, &cart, &voltage}) series->x.push_back(time_s);
    theta.y.push_back(degrees_per_radian * row.theta_rad);
    cart.y.push_back(1e3 * row.cart_m);
    voltage.y.push_back(row.voltage_v);
  }
  const bool is_sweep = piece.as<pieces::DelaySweep>() != nullptr;
  theta.color = is_sweep ? color::of_outcome(trial.outcome) : color::angle;
  cart.color = color::cart;
  voltage.color = color::voltage;
  first.title = is_sweep ? milliseconds(trial.trial.delay_s) + " ms: " + trial.outcome : trial.run_directory;
  first.link = link;
  first.x.label = second.x.label = "time [s]";
  first.width_px = second.width_px = 450;
  first.height_px = second.height_px = 190;
  const bool hangs = piece.as<pieces::FreeDecay>() != nullptr;
  first.y.label = balances(piece) || hangs ? "theta [deg]" : "x [mm]";
  first.series = {balances(piece) || hangs ? theta : cart};
  second.y.label = balances(piece) ? "x [mm]" : "V";
  second.series = {balances(piece) ? cart : voltage};
  if (is_sweep || hangs) return {first};
  second.title = balances(piece) ? "cart of the same run" : "voltage of the same run";
  std::vector<Plot> plots = {first, second};
  align(plots);
  return plots;
}

/// Small plots of each run of a piece, with links to the reports of the runs.
void add_runs(HtmlPage& page, const std::filesystem::path& folder, const Record& record, std::size_t piece) {
  std::vector<Plot> plots;
  for (std::size_t i = 0; i < record.trials.size(); ++i) {
    const TrialResult& trial = record.trials[i];
    if (trial.trial.piece != piece || record.links[i].empty()) continue;
    const RunData run = load_run_data(folder / trial.run_directory);
    for (Plot& plot : small_plots(run, record.pieces[piece], trial, record.links[i]))
      plots.push_back(std::move(plot));
  }
  if (plots.empty()) return;
  const Piece& shown = record.pieces[piece];
  if (!shown.as<pieces::DelaySweep>()) page.section(shown.label);
  page.figures(plots, "All runs. Each title links to the report of the run.");
}

/// Comparisons of alternating controllers.
void add_comparisons(HtmlPage& page, const std::filesystem::path& folder, const Record& record) {
  if (std::none_of(record.pieces.begin(), record.pieces.end(), compares)) return;
  for (const PieceComparison& piece : paired_comparisons(folder)) {
    page.section(piece.label + ": alternating controllers");
    for (const std::string& sentence : paired_sentences(piece)) page.paragraph(sentence);
    add_paired_tables(page, piece);
  }
}

}  // namespace

bool is_experiment_folder(const std::filesystem::path& folder) {
  return holds_experiment(folder);
}

std::filesystem::path write_experiment_report(const std::filesystem::path& folder) {
  Record record = read_record(folder);
  if (record.trials.empty())
    throw ConfigError(folder.string() + " contains no finished run: repeat the experiment command");
  write_run_reports(folder, record);
  HtmlPage page("Experiment " + record.name, folder.string());
  const bool all_made = !next_trial(record.pieces, record.trials);
  const std::string missing =
      all_made ? missing_transitions(record.pieces, record.trials)
               : "the experiment ended before its last run: repeat its command to continue";
  page.answer(missing.empty() ? Tone::good : Tone::warning, missing.empty() ? "Complete" : "Not complete",
              std::to_string(record.trials.size()) + " runs" + (missing.empty() ? "" : "; " + missing) + ".");
  for (std::size_t i = 0; i < record.pieces.size(); ++i) {
    std::vector<TrialResult> trials;
    for (const TrialResult& r : record.trials)
      if (r.trial.piece == i) trials.push_back(r);
    if (const auto* sweep = record.pieces[i].as<pieces::DelaySweep>(); sweep && !trials.empty())
      add_sweep(page, folder, record.pieces[i].label, *sweep, trials);
    add_runs(page, folder, record, i);
  }
  add_comparisons(page, folder, record);
  page.section("Runs");
  HtmlTable table{{"run directory", "delay [ms]", "outcome", "start [degree]", "angle [degree]", "cart [mm]",
                   "frequency [Hz]"},
                  {},
                  "Each name links to the report of the run."};
  for (const TrialResult& r : record.trials)
    table.rows.push_back({r.run_directory, milliseconds(r.trial.delay_s), r.outcome,
                          number_text(r.theta0_rad * degrees_per_radian, 3),
                          number_text(r.theta_amplitude_rad * degrees_per_radian, 3),
                          number_text(1e3 * r.cart_amplitude_m, 3),
                          std::isfinite(r.frequency_hz) ? number_text(r.frequency_hz, 3) : "-"});
  table.links = record.links;
  page.table(table);
  for (const std::string& problem : record.problems) page.note(Tone::warning, problem + ".");
  const std::filesystem::path file = folder / "report.html";
  page.write(file);
  return file;
}

}  // namespace upright
