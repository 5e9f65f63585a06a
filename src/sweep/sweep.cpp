#include "sweep.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>

#include "design/delay_margin.hpp"
#include "model/linear_plant.hpp"
#include "sweep_journal.hpp"
#include "sweep_stages.hpp"
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

constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();

bool earlier(const LoopCase& a, const LoopCase& b) {
  return a.theta0_rad != b.theta0_rad ? a.theta0_rad < b.theta0_rad : a.delay_s < b.delay_s;
}

/// Where the outcome of one starting angle becomes `from` or worse: between `low_s` (not yet) and `high_s`.
struct Bracket {
  std::size_t angle = 0;
  Outcome from = Outcome::fell;
  double low_s = nowhere;
  double high_s = nowhere;

  bool open(double tolerance_s) const {
    return !std::isnan(low_s) && !std::isnan(high_s) && high_s - low_s > tolerance_s * (1.0 + 1e-9);
  }
};

class TransitionSearch {
 public:
  TransitionSearch(const SweepConfig& config, SweepStages& stages) : config_(config), stages_(stages) {}

  /// Brackets from the whole grid, `runs` by angle and then delay.
  void bracket_on_grid(const std::vector<SweepRun>& runs) {
    const std::size_t delays = config_.delay_s.size();
    for (std::size_t a = 0; a < config_.theta0_rad.size(); ++a)
      for (const Outcome from : {Outcome::oscillating, Outcome::fell}) {
        Bracket bracket{a, from, nowhere, nowhere};
        for (std::size_t d = 0; d < delays; ++d) {
          if (runs[a * delays + d].outcome(config_.stable_below_rad) >= from) {
            bracket.high_s = config_.delay_s[d];
            if (d > 0) bracket.low_s = config_.delay_s[d - 1];
            break;
          }
        }
        brackets_.push_back(bracket);
      }
  }

  /// Brackets by halving the list of delays; returns the runs made for it. False: stopped.
  bool bracket_by_halving(std::vector<SweepRun>& runs) {
    struct Range {
      std::ptrdiff_t low, high;
    };
    const auto delays = static_cast<std::ptrdiff_t>(config_.delay_s.size());
    for (std::size_t a = 0; a < config_.theta0_rad.size(); ++a)
      for (const Outcome from : {Outcome::oscillating, Outcome::fell})
        brackets_.push_back({a, from, nowhere, nowhere});
    std::vector<Range> ranges(brackets_.size(), {-1, delays});
    const auto middle = [&](const Range& range) { return (range.low + range.high) / 2; };
    const auto step = [&](const std::vector<SweepRun>& made) {
      for (std::size_t b = 0; b < brackets_.size(); ++b) {
        if (ranges[b].high - ranges[b].low <= 1) continue;
        const SweepRun* run = find(made, case_at(brackets_[b], delay_at(middle(ranges[b]))));
        (is_past(*run, brackets_[b]) ? ranges[b].high : ranges[b].low) = middle(ranges[b]);
      }
    };
    while (true) {
      std::vector<LoopCase> cases;
      for (std::size_t b = 0; b < brackets_.size(); ++b)
        if (ranges[b].high - ranges[b].low > 1)
          cases.push_back(case_at(brackets_[b], delay_at(middle(ranges[b]))));
      if (cases.empty()) break;
      if (!make(cases, runs, step)) return false;
    }
    for (std::size_t b = 0; b < brackets_.size(); ++b) {
      if (ranges[b].high < delays) brackets_[b].high_s = delay_at(ranges[b].high);
      if (ranges[b].low >= 0) brackets_[b].low_s = delay_at(ranges[b].low);
    }
    return true;
  }

  /// Bisection of all brackets together. False: stopped.
  bool refine(std::vector<SweepRun>& runs) {
    const auto middle = [](const Bracket& b) { return 0.5 * (b.low_s + b.high_s); };
    while (true) {
      std::vector<LoopCase> cases;
      for (const Bracket& bracket : brackets_)
        if (bracket.open(transition_tolerance_s)) cases.push_back(case_at(bracket, middle(bracket)));
      if (cases.empty()) return true;
      const auto step = [&](const std::vector<SweepRun>& made) {
        for (Bracket& bracket : brackets_) {
          if (!bracket.open(transition_tolerance_s)) continue;
          const double delay = middle(bracket);
          (is_past(*find(made, case_at(bracket, delay)), bracket) ? bracket.high_s : bracket.low_s) = delay;
        }
      };
      if (!make(cases, runs, step)) return false;
    }
  }

  std::vector<Transition> transitions() const {
    std::vector<Transition> all;
    for (std::size_t a = 0; a < config_.theta0_rad.size(); ++a)
      all.push_back({config_.theta0_rad[a], brackets_[2 * a].high_s, brackets_[2 * a + 1].high_s});
    return all;
  }

 private:
  double delay_at(std::ptrdiff_t index) const { return config_.delay_s[static_cast<std::size_t>(index)]; }
  LoopCase case_at(const Bracket& bracket, double delay_s) const {
    return {config_.theta0_rad[bracket.angle], delay_s};
  }
  bool is_past(const SweepRun& run, const Bracket& bracket) const {
    return run.outcome(config_.stable_below_rad) >= bracket.from;
  }

  static const SweepRun* find(const std::vector<SweepRun>& runs, const LoopCase& wanted) {
    const auto it =
        std::lower_bound(runs.begin(), runs.end(), wanted,
                         [](const SweepRun& run, const LoopCase& c) { return earlier(run.start, c); });
    return &*it;
  }

  /// Makes the runs (each once), hands them on sorted, and adds them to `runs`.
  template <class Step>
  bool make(std::vector<LoopCase>& cases, std::vector<SweepRun>& runs, const Step& step) {
    std::sort(cases.begin(), cases.end(), earlier);
    cases.erase(std::unique(cases.begin(), cases.end(),
                            [](const LoopCase& a, const LoopCase& b) {
                              return a.theta0_rad == b.theta0_rad && a.delay_s == b.delay_s;
                            }),
                cases.end());
    const std::vector<SweepRun> made = stages_.run(cases);
    if (stages_.interrupted()) return false;
    step(made);
    runs.insert(runs.end(), made.begin(), made.end());
    return true;
  }

  const SweepConfig& config_;
  SweepStages& stages_;
  std::vector<Bracket> brackets_;
};

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
  TransitionSearch search(config, stages);
  std::vector<SweepRun> runs;
  search.bracket_by_halving(runs);
  search.refine(runs);
  return search.transitions();
}

SweepResult run_sweep(const SweepConfig& config, const std::filesystem::path& folder,
                      const SweepOptions& options, SweepExecutor& executor) {
  const std::vector<LinearMargin> margins = linear_margins(config);
  refuse_unstable(config, margins);
  prepare_folder(folder, options.overwrite);
  const std::string mode = options.transitions_only ? "# transitions only\n" : "";
  SweepJournal journal(folder / journal_name, mode + config.resolved_text);
  SweepStages stages(config, options, executor, &journal);
  TransitionSearch search(config, stages);
  SweepResult result;
  std::vector<SweepRun> refining;
  const bool over_plants = config.uncertainty && !options.transitions_only;
  if (over_plants) stages.expect_plants(grid_cases(config));
  bool whole = true;
  if (options.transitions_only) {
    whole = search.bracket_by_halving(result.runs) && search.refine(result.runs);
  } else {
    result.runs = stages.run(grid_cases(config));
    whole = !stages.interrupted();
    sort_runs(result.runs);
    if (whole) {
      search.bracket_on_grid(result.runs);
      whole = search.refine(refining);
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
  result.transitions = search.transitions();
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
