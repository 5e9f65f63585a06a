#include "sweep_stages.hpp"

#include <algorithm>
#include <ctime>

#include "sweep_tasks.hpp"

namespace upright {

namespace {

/// The stages before it are fewer: their number depends on what the search for transitions finds.
constexpr std::size_t plants_stage = 1'000'000;

bool are_of(const std::vector<SweepRun>& runs, std::span<const LoopCase> cases) {
  return std::equal(runs.begin(), runs.end(), cases.begin(), cases.end(),
                    [](const SweepRun& run, const LoopCase& c) {
                      return run.start.theta0_rad == c.theta0_rad && run.start.delay_s == c.delay_s;
                    });
}

std::size_t parts(std::size_t whole, std::size_t size) {
  return (whole + size - 1) / size;
}

double processor_time_s() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Size of groups of about the same size, at most `largest`.
std::size_t evenly(std::size_t all, std::size_t largest) {
  return all == 0 ? largest : parts(all, parts(all, largest));
}

/// Size of the groups of so many runs.
std::size_t even_group(const SweepConfig& config, std::size_t runs) {
  const std::size_t size = runs_per_call(config);
  return size == sweep_group_size(config) ? size : evenly(runs, size);
}

template <class T>
std::span<T> group_of(std::span<T> all, std::size_t size, std::size_t number) {
  const std::size_t first = number * size;
  return all.subspan(first, std::min(size, all.size() - first));
}
std::span<const LoopCase> group_of(const std::vector<LoopCase>& cases, std::size_t size, std::size_t number) {
  return group_of(std::span(cases), size, number);
}

std::size_t open_in(std::span<const StartSearch> searches) {
  std::size_t open = 0;
  for (const StartSearch& search : searches) open += search.open();
  return open;
}

}  // namespace

SweepStages::SweepStages(const SweepConfig& config, const SweepOptions& options, SweepExecutor& executor,
                         SweepJournal* journal)
    : config_(config),
      options_(options),
      executor_(executor),
      journal_(journal),
      group_size_(sweep_group_size(config)) {}

std::vector<SweepRun> SweepStages::run(const std::vector<LoopCase>& cases) {
  std::vector<SweepRun> runs(cases.size());
  const std::size_t size_of_group = even_group(config_, cases.size());
  const auto group = [&](std::size_t g) { return group_of(cases, size_of_group, g); };
  const auto size = [&](std::size_t g) { return group(g).size(); };
  known_ += cases.size();
  const auto take = [&](std::size_t g, const SweepNumbers& result) {
    const std::vector<SweepRun> made = runs_of(result);
    if (!are_of(made, group(g))) return false;
    std::copy(made.begin(), made.end(), runs.begin() + static_cast<std::ptrdiff_t>(g * size_of_group));
    return true;
  };
  const auto task_of = [&](std::size_t g) { return plain_task(group(g)); };
  make({stage_++, parts(cases.size(), size_of_group), task_of, size, size, take});
  return interrupted_ ? std::vector<SweepRun>() : runs;
}

bool SweepStages::search(std::vector<StartSearch>& searches, std::vector<SweepRun>& runs) {
  if (!lanes_search(config_)) return search_in_rounds(searches, runs);
  const std::size_t starts = evenly(searches.size(), starts_per_search(config_));
  const std::size_t tasks = parts(searches.size(), starts);
  const auto group = [&](std::size_t task) { return group_of(std::span(searches), starts, task); };
  // How many runs a search needs is known at its end. Until then there is one for each open bracket.
  std::vector<std::size_t> runs_of_task(tasks);
  known_ += open_in(searches);
  const auto take = [&](std::size_t task, const SweepNumbers& result) {
    const std::vector<SweepRun> made = runs_of(result);
    const std::span<StartSearch> mine = group(task);
    const std::size_t open = open_in(mine);
    if (!follow({mine.begin(), mine.end()}, made, mine)) return false;
    runs_of_task[task] = made.size();
    known_ = known_ + made.size() - open;
    runs.insert(runs.end(), made.begin(), made.end());
    return true;
  };
  const auto task_of = [&](std::size_t task) { return search_task(group(task)); };
  const auto size = [&](std::size_t task) { return group(task).size(); };
  make({stage_++, tasks, task_of, size, [&](std::size_t task) { return runs_of_task[task]; }, take});
  return !interrupted_;
}

/// All searches go in step, first through the list: what comes of a run may depend on those beside it.
bool SweepStages::search_in_rounds(std::vector<StartSearch>& searches, std::vector<SweepRun>& runs) {
  for (const bool on_list : {true, false})
    while (true) {
      std::vector<LoopCase> cases;
      std::vector<std::size_t> of;
      for (std::size_t s = 0; s < searches.size(); ++s) {
        const std::size_t before = cases.size();
        while (const std::optional<LoopCase> wanted = searches[s].next(on_list)) cases.push_back(*wanted);
        std::sort(cases.begin() + static_cast<std::ptrdiff_t>(before), cases.end(),
                  [](const LoopCase& a, const LoopCase& b) { return a.delay_s < b.delay_s; });
        of.resize(cases.size(), s);
      }
      if (cases.empty()) break;
      const std::vector<SweepRun> made = run(cases);
      if (interrupted_) return false;
      for (std::size_t i = 0; i < made.size(); ++i) searches[of[i]].take(made[i]);
      runs.insert(runs.end(), made.begin(), made.end());
    }
  return true;
}

void SweepStages::expect_plants(const std::vector<LoopCase>& cases) {
  const std::size_t samples = config_.uncertainty->samples;
  known_ += cases.size() * samples;
  if (!options_.estimated) return;
  SweepEstimate estimate = estimate_sweep(config_);
  const std::size_t tasks = parts(cases.size(), group_size_) * parts(samples, plants_per_task(config_));
  const std::size_t kept = std::min(tasks, journal_ != nullptr ? journal_->count(plants_stage) : 0);
  const double share = static_cast<double>(tasks - kept) / static_cast<double>(tasks);
  estimate.runs = static_cast<std::size_t>(share * static_cast<double>(estimate.runs));
  options_.estimated(estimate);
}

std::vector<PlantCounts> SweepStages::count_plants(const std::vector<LoopCase>& cases) {
  std::vector<PlantCounts> counts(cases.size());
  const std::uint32_t samples = config_.uncertainty->samples, together = plants_per_task(config_);
  const std::size_t blocks = parts(samples, together);
  const auto group = [&](std::size_t task) { return group_of(cases, group_size_, task / blocks); };
  const auto first = [&](std::size_t task) { return static_cast<std::uint32_t>(task % blocks) * together; };
  const auto plants = [&](std::size_t task) { return std::min(together, samples - first(task)); };
  const auto task_of = [&](std::size_t task) { return plants_task(group(task), first(task), plants(task)); };
  make({plants_stage, parts(cases.size(), group_size_) * blocks, task_of,
        [&](std::size_t task) { return group(task).size(); },
        [&](std::size_t task) { return group(task).size() * plants(task); },
        [&](std::size_t task, const SweepNumbers& result) {
          const std::vector<PlantCounts> made = counts_of(task_of(task), result);
          for (std::size_t i = 0; i < made.size(); ++i) {
            PlantCounts& all = counts[task / blocks * group_size_ + i];
            all.falls += made[i].falls;
            all.oscillates += made[i].oscillates;
          }
          return !made.empty();
        }});
  return interrupted_ ? std::vector<PlantCounts>() : counts;
}

void SweepStages::make(const Stage& stage) {
  std::vector<std::size_t> open;
  for (std::size_t task = 0; task < stage.tasks; ++task) {
    const SweepNumbers* kept = journal_ != nullptr ? journal_->find(stage.number, task) : nullptr;
    if (kept != nullptr && stage.take(task, *kept))
      done_ += stage.runs_of(task);
    else
      open.push_back(task);
  }
  std::size_t finished = 0;
  executor_.run(
      open.size(), [&](std::size_t at) { return stage.task_of(open[at]); },
      [&](std::size_t at, const SweepNumbers& result) {
        const std::size_t task = open[at];
        if (journal_ != nullptr) journal_->keep(stage.number, task, stage.cases_of(task), result);
        stage.take(task, result);
        ++finished;
        done_ += stage.runs_of(task);
        made_ += stage.runs_of(task);
        if (options_.progress) options_.progress(done_, known_);
      },
      options_.stop);
  interrupted_ = finished < open.size();
}

std::vector<LoopCase> grid_cases(const SweepConfig& config) {
  std::vector<LoopCase> cases;
  for (const double delay : config.delay_s)
    for (const double theta0 : config.theta0_rad) cases.push_back({theta0, delay});
  return cases;
}

SweepEstimate estimate_sweep(const SweepConfig& config) {
  constexpr std::size_t probes = 12;
  const std::vector<LoopCase> cases = grid_cases(config);
  const std::size_t size = sweep_group_size(config), groups = parts(cases.size(), size);
  SweepEstimate estimate;
  estimate.runs = cases.size() * (1 + (config.uncertainty ? config.uncertainty->samples : 0));
  compute_task(config, plain_task(group_of(cases, size, 0)));  // the first run of a program costs more
  std::size_t made = 0;
  const double begin_s = processor_time_s();
  for (std::size_t i = 0; i < std::min(probes, groups); ++i) {
    const std::size_t g = i * groups / std::min(probes, groups);
    const std::span<const LoopCase> group = group_of(cases, size, g);
    made += group.size();
    compute_task(config,
                 config.uncertainty
                     ? plants_task(group, static_cast<std::uint32_t>(i) % config.uncertainty->samples, 1)
                     : plain_task(group));
  }
  estimate.run_s = (processor_time_s() - begin_s) / static_cast<double>(made);
  return estimate;
}

}  // namespace upright
