#include "sweep.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "design/delay_margin.hpp"
#include "model/linear_plant.hpp"
#include "sweep_journal.hpp"
#include "sweep_stages.hpp"
#include "transition_search.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

std::string outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::stable:
      return "stable";
    case Outcome::oscillating:
      return "oscillating";
    case Outcome::fell:
      break;
  }
  return "fell";
}

Outcome SweepRun::outcome(double stable_below_rad) const {
  if (!std::isnan(fall_time_s)) return Outcome::fell;
  return theta_amplitude_rad < stable_below_rad ? Outcome::stable : Outcome::oscillating;
}

namespace {

bool earlier(const LoopCase& a, const LoopCase& b) {
  return a.theta0_rad != b.theta0_rad ? a.theta0_rad < b.theta0_rad : a.delay_s < b.delay_s;
}

std::vector<StartSearch> searches_of_list(const SweepConfig& config) {
  std::vector<StartSearch> searches;
  for (const double theta0 : config.theta0_rad) searches.emplace_back(config, theta0);
  return searches;
}

/// `grid`: its runs, by angle and then delay.
std::vector<StartSearch> searches_of_grid(const SweepConfig& config, std::span<const SweepRun> grid) {
  std::vector<StartSearch> searches;
  const std::size_t delays = config.delay_s.size();
  for (std::size_t a = 0; a < config.theta0_rad.size(); ++a)
    searches.emplace_back(config, grid.subspan(a * delays, delays));
  return searches;
}

std::vector<Transition> transitions_of(const std::vector<StartSearch>& searches) {
  std::vector<Transition> all;
  all.reserve(searches.size());
  for (const StartSearch& search : searches) all.push_back(search.transition());
  return all;
}

void sort_runs(std::vector<SweepRun>& runs) {
  std::stable_sort(runs.begin(), runs.end(),
                   [](const SweepRun& a, const SweepRun& b) { return earlier(a.start, b.start); });
  runs.erase(std::unique(runs.begin(), runs.end(),
                         [](const SweepRun& a, const SweepRun& b) {
                           return a.start.theta0_rad == b.start.theta0_rad &&
                                  a.start.delay_s == b.start.delay_s;
                         }),
             runs.end());
}

std::string sweep_csv(const SweepConfig& config, const std::vector<SweepRun>& runs) {
  std::string text = "theta0_rad,delay_s,outcome,theta_amplitude_rad,cart_amplitude_m,fall_time_s\n";
  for (const SweepRun& run : runs)
    text += exact_text(run.start.theta0_rad) + "," + exact_text(run.start.delay_s) + "," +
            outcome_name(run.outcome(config.stable_below_rad)) + "," + exact_text(run.theta_amplitude_rad) +
            "," + exact_text(run.cart_amplitude_m) + "," + exact_text(run.fall_time_s) + "\n";
  return text;
}

std::string transitions_csv(const std::vector<Transition>& transitions) {
  std::string text = "theta0_rad,oscillates_from_s,falls_from_s\n";
  for (const Transition& t : transitions)
    text += exact_text(t.theta0_rad) + "," + exact_text(t.oscillates_from_s) + "," +
            exact_text(t.falls_from_s) + "\n";
  return text;
}

std::string margins_csv(const std::vector<LinearMargin>& margins) {
  std::string text = "model,critical_delay_s,crossing_radps\n";
  for (const LinearMargin& margin : margins)
    text += margin.model + "," + exact_text(margin.critical_delay_s) + "," +
            exact_text(margin.crossing_radps) + "\n";
  return text;
}

/// Points by angle, then delay, from counts in the order of grid_cases().
std::vector<UncertainPoint> points_of(const SweepConfig& config, const std::vector<PlantCounts>& counts) {
  const std::size_t angles = config.theta0_rad.size();
  std::vector<UncertainPoint> points;
  for (std::size_t a = 0; a < angles; ++a)
    for (std::size_t d = 0; d < config.delay_s.size(); ++d)
      points.push_back({{config.theta0_rad[a], config.delay_s[d]}, counts[d * angles + a]});
  return points;
}

/// It goes last: while it is there the sweep is unfinished.
constexpr const char* journal_name = "sweep.partial";

/// Whole or not at all.
void write_file(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path beside = file.string() + ".new";
  std::ofstream out(beside, std::ios::binary);
  out << text;
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(beside, file, error);
  if (!out || error)
    throw Error(ExitCode::usage, "cannot write " + file.string() + ": check the folder and its free space");
}

void prepare_folder(const std::filesystem::path& folder, bool overwrite) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw Error(ExitCode::usage,
                "cannot create the folder " + folder.string() + ": check the path and its permissions");
  if (overwrite) std::filesystem::remove(folder / journal_name, error);
  // Beside a journal they are of a call that ended while it wrote them: it was not the last word.
  const bool unfinished = std::filesystem::exists(folder / journal_name, error);
  for (const char* name : {"sweep.csv", "uncertainty.csv", "transitions.csv", "margins.csv", "sweep.yaml"}) {
    const std::filesystem::path file = folder / name;
    if (overwrite)
      std::filesystem::remove(file, error);
    else if (!unfinished && std::filesystem::exists(file, error))
      throw ConfigError(file.string() +
                        " already exists: choose another folder with --out, or replace it with --overwrite");
  }
}

}  // namespace

std::vector<LinearMargin> linear_margins(const SweepConfig& config) {
  if (config.setup.make_parts) return {};
  constexpr double usual_smoothing = 100.0;  // as `upright margin` takes it
  const double smoothing =
      config.setup.model.smoothing > 0.0 ? config.setup.model.smoothing : usual_smoothing;
  ControlConfig control = config.setup.control;
  control.delay_s = 0.0;
  const auto margin_of = [&](const char* name, const Plant& plant) {
    const LoopMargin margin = config.setup.sampled ? sampled_margin(plant, control, smoothing, false)
                                                   : continuous_margin(plant, control.gains, smoothing);
    return LinearMargin{name, margin.critical_delay_s, margin.crossing_radps};
  };
  std::vector<LinearMargin> margins{margin_of("near rest", config.plant)};
  const Plant sliding = sliding_plant(config.plant);
  if (sliding.effects.size() < config.plant.effects.size()) margins.push_back(margin_of("sliding", sliding));
  return margins;
}

void refuse_unstable(const SweepConfig& config, const std::vector<LinearMargin>& margins) {
  if (margins.empty() || std::any_of(margins.begin(), margins.end(), [](const LinearMargin& margin) {
        return margin.critical_delay_s > 0.0;
      }))
    return;
  throw ConfigError((config.plant_file.empty() ? std::string("the plant") : config.plant_file.string()) +
                    " is unstable with these gains even without delay: check the plant file, or design gains "
                    "for it (upright design PLANT --out GAINS)");
}

std::vector<Transition> find_transitions(const SweepConfig& config, SweepExecutor& executor) {
  const SweepOptions options;
  SweepStages stages(config, options, executor, nullptr);
  std::vector<StartSearch> searches = searches_of_list(config);
  std::vector<SweepRun> runs;
  stages.search(searches, runs);
  return transitions_of(searches);
}

SweepResult run_sweep(const SweepConfig& config, const std::filesystem::path& folder,
                      const SweepOptions& options, SweepExecutor& executor) {
  const std::vector<LinearMargin> margins = linear_margins(config);
  refuse_unstable(config, margins);
  prepare_folder(folder, options.overwrite);
  const std::string mode = options.transitions_only ? "# transitions only\n" : "";
  SweepJournal journal(folder / journal_name, mode + config.resolved_text);
  SweepStages stages(config, options, executor, &journal);
  std::vector<StartSearch> searches;
  SweepResult result;
  const bool over_plants = config.uncertainty && !options.transitions_only;
  if (over_plants) stages.expect_plants(grid_cases(config));
  bool whole = true;
  if (options.transitions_only) {
    searches = searches_of_list(config);
    whole = stages.search(searches, result.runs);
  } else {
    result.runs = stages.run(grid_cases(config));
    whole = !stages.interrupted();
    sort_runs(result.runs);
    if (whole) {
      searches = searches_of_grid(config, result.runs);
      std::vector<SweepRun> between;
      whole = stages.search(searches, between);
    }
  }
  if (whole && over_plants) {
    const std::vector<PlantCounts> counts = stages.count_plants(grid_cases(config));
    whole = !stages.interrupted();
    if (whole) result.uncertain = points_of(config, counts);
  }
  result.runs_made = stages.runs_made();
  result.interrupted = !whole;
  if (!whole) return result;
  sort_runs(result.runs);
  result.transitions = transitions_of(searches);
  journal.check();
  write_file(folder / "sweep.yaml", mode + config.resolved_text);
  write_file(folder / "margins.csv", margins_csv(margins));
  write_file(folder / "transitions.csv", transitions_csv(result.transitions));
  if (over_plants)
    write_file(folder / "uncertainty.csv", uncertainty_csv(result.uncertain, config.uncertainty->samples));
  write_file(folder / "sweep.csv", sweep_csv(config, result.runs));
  journal.remove();
  return result;
}

}  // namespace upright
