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

/// Size of the groups of so many runs. Where a run does not depend on its group, all are of about the same
/// size.
std::size_t even_group(const SweepConfig& config, std::size_t runs) {
  const std::size_t size = runs_per_call(config);
  if (size == sweep_group_size(config) || runs == 0) return size;
  return parts(runs, parts(runs, size));
}

std::span<const LoopCase> group_of(const std::vector<LoopCase>& cases, std::size_t size, std::size_t number) {
  const std::size_t first = number * size;
  return std::span(cases).subspan(first, std::min(size, cases.size() - first));
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
  make({stage_++, parts(cases.size(), size_of_group), [&](std::size_t g) { return plain_task(group(g)); },
        size, size,
        [&](std::size_t g, const SweepNumbers& result) {
          const std::vector<SweepRun> made = runs_of(result);
          if (!are_of(made, group(g))) return false;
          std::copy(made.begin(), made.end(), runs.begin() + static_cast<std::ptrdiff_t>(g * size_of_group));
          return true;
        }});
  return interrupted_ ? std::vector<SweepRun>() : runs;
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
