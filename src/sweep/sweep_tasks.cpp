#include "sweep_tasks.hpp"

#include <algorithm>
#include <bit>

#include "sim/loop/fast_loop.hpp"

namespace upright {

namespace {

/// Lanes that go on with the next run when one ends waste less with more runs for each of them.
constexpr std::size_t refill_of_lanes = 4;

// A task: its first plant, its number of plants (0: the plant of the file), and its starts. With
// `searches_mark` for a number of plants: searches.
constexpr double searches_mark = -1.0;
constexpr std::size_t header_numbers = 2, case_numbers = 2, run_numbers = 5, count_numbers = 2;

bool runs_on_lanes(const SweepConfig& config, const LoopSetup& setup) {
  return config.engine != SweepEngine::reference && lanes_can_run(setup);
}

LaneRegisters registers_of(const SweepConfig& config) {
  return config.engine == SweepEngine::fast ? LaneRegisters::wide : LaneRegisters::baseline;
}

std::vector<LoopCase> cases_of(const SweepNumbers& task) {
  std::vector<LoopCase> cases;
  for (std::size_t at = header_numbers; at + case_numbers <= task.size(); at += case_numbers)
    cases.push_back({task[at], task[at + 1]});
  return cases;
}

SweepNumbers task_of(std::span<const LoopCase> cases, double first_plant, double plants) {
  SweepNumbers task{first_plant, plants};
  for (const LoopCase& start : cases) task.insert(task.end(), {start.theta0_rad, start.delay_s});
  return task;
}

SweepRun run_of(const LoopCase& start, const LoopResult& result) {
  return {start, result.fall_time_s, result.theta_amplitude_rad, result.cart_amplitude_m};
}

void run_alone(const SweepConfig& config, const LoopSetup& setup, std::span<const LoopCase> cases,
               std::span<LoopResult> results) {
  for (std::size_t i = 0; i < cases.size(); ++i)
    results[i] = config.engine == SweepEngine::reference ? run_with_reference(setup, cases[i])
                                                         : run_with_events(setup, cases[i]);
}

/// FNV-1a over the numbers' bits, as a whole number that a double holds exactly.
double checksum(const SweepNumbers& task, std::span<const double> counts) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto take = [&hash](double number) {
    for (auto bits = std::bit_cast<std::uint64_t>(number); bits != 0; bits >>= 8u)
      hash = (hash ^ (bits & 0xffu)) * 0x100000001b3u;
    hash = (hash ^ 0x100u) * 0x100000001b3u;
  };
  std::for_each(task.begin(), task.end(), take);
  std::for_each(counts.begin(), counts.end(), take);
  return static_cast<double>(hash >> 12u);
}

SweepNumbers count_plants(const SweepConfig& config, const SweepNumbers& task) {
  const std::vector<LoopCase> cases = cases_of(task);
  const auto first = static_cast<std::uint32_t>(task[0]), plants = static_cast<std::uint32_t>(task[1]);
  SweepNumbers result(1 + cases.size() * count_numbers, 0.0);
  const std::vector<LoopResult> runs = run_plants(config, first, plants, cases);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::size_t k = i % cases.size();
    const Outcome outcome = run_of(cases[k], runs[i]).outcome(config.stable_below_rad);
    if (outcome == Outcome::fell) result[1 + k * count_numbers] += 1.0;
    if (outcome == Outcome::oscillating) result[2 + k * count_numbers] += 1.0;
  }
  result[0] = checksum(task, std::span(result).subspan(1));
  return result;
}

/// Runs that searches want, of each in turn.
class SearchedRuns final : public LoopSource {
 public:
  SearchedRuns(const SweepConfig& config, const SweepNumbers& task) : config_(config) {
    for (std::size_t at = header_numbers; at + StartSearch::numbers <= task.size();
         at += StartSearch::numbers)
      searches_.emplace_back(config, std::span(task).subspan(at).first<StartSearch::numbers>());
  }

  bool next(LoopRun& run) override {
    for (std::size_t i = 0; i < searches_.size(); ++i) {
      const std::size_t search = turn_;
      turn_ = turn_ + 1 == searches_.size() ? 0 : turn_ + 1;
      if (const std::optional<LoopCase> wanted = searches_[search].next()) {
        run = {runs_.size(), *wanted};
        runs_.push_back({*wanted});
        search_of_.push_back(search);
        return true;
      }
    }
    return false;
  }
  void take(std::size_t number, const LoopResult& result) override {
    runs_[number] = run_of(runs_[number].start, result);
    searches_[search_of_[number]].take(runs_[number]);
  }
  double longest_delay_s() const override { return config_.delay_s.back(); }

  /// In an order that does not depend on when they ended.
  std::vector<SweepRun> sorted() {
    std::vector<SweepRun> runs = runs_;
    std::sort(runs.begin(), runs.end(), [](const SweepRun& a, const SweepRun& b) {
      return a.start.theta0_rad != b.start.theta0_rad ? a.start.theta0_rad < b.start.theta0_rad
                                                      : a.start.delay_s < b.start.delay_s;
    });
    return runs;
  }

 private:
  const SweepConfig& config_;
  std::vector<StartSearch> searches_;
  std::vector<SweepRun> runs_;          ///< by number
  std::vector<std::size_t> search_of_;  ///< by number of a run
  std::size_t turn_ = 0;
};

std::vector<SweepRun> search(const SweepConfig& config, const SweepNumbers& task) {
  SearchedRuns runs(config, task);
  run_source_on_lanes(config.setup, runs, registers_of(config));
  return runs.sorted();
}

}  // namespace

SweepNumbers search_task(std::span<const StartSearch> searches) {
  SweepNumbers task{0.0, searches_mark};
  for (const StartSearch& search : searches) {
    const auto numbers = search.as_numbers();
    task.insert(task.end(), numbers.begin(), numbers.end());
  }
  return task;
}

bool lanes_search(const SweepConfig& config) {
  return runs_on_lanes(config, config.setup) && lanes_refill(config.setup);
}

std::size_t starts_per_search(const SweepConfig& config) {
  constexpr std::size_t brackets = 2;  // each wants a run at a time
  return runs_per_call(config) / brackets;
}

SweepNumbers plain_task(std::span<const LoopCase> cases) {
  return task_of(cases, 0.0, 0.0);
}

SweepNumbers plants_task(std::span<const LoopCase> cases, std::uint32_t first_plant, std::uint32_t plants) {
  return task_of(cases, first_plant, plants);
}

SweepNumbers compute_task(const SweepConfig& config, const SweepNumbers& task) {
  if (task[1] > 0.0) return count_plants(config, task);
  SweepNumbers result;
  for (const SweepRun& run :
       task[1] == searches_mark ? search(config, task) : run_sweep_group(config, cases_of(task)))
    result.insert(result.end(), {run.start.theta0_rad, run.start.delay_s, run.fall_time_s,
                                 run.theta_amplitude_rad, run.cart_amplitude_m});
  return result;
}

std::vector<SweepRun> runs_of(const SweepNumbers& result) {
  if (result.size() % run_numbers != 0) return {};
  std::vector<SweepRun> runs;
  for (auto at = result.begin(); at != result.end(); at += run_numbers)
    runs.push_back({{at[0], at[1]}, at[2], at[3], at[4]});
  return runs;
}

std::vector<PlantCounts> counts_of(const SweepNumbers& task, const SweepNumbers& result) {
  const std::size_t cases = (task.size() - header_numbers) / case_numbers;
  if (result.size() != 1 + cases * count_numbers || result[0] != checksum(task, std::span(result).subspan(1)))
    return {};
  std::vector<PlantCounts> counts;
  for (auto at = result.begin() + 1; at != result.end(); at += count_numbers)
    counts.push_back({static_cast<std::uint32_t>(at[0]), static_cast<std::uint32_t>(at[1])});
  return counts;
}

std::vector<LoopResult> run_plants(const SweepConfig& config, std::uint32_t first, std::uint32_t count,
                                   std::span<const LoopCase> cases) {
  std::vector<LoopResult> results(count * cases.size());
  const auto of_plant = [&](std::size_t i) {
    return std::span(results).subspan(i * cases.size(), cases.size());
  };
  // A drawn plant may be too fast for lanes where the others are not.
  std::vector<PlantModel<double>> on_lanes;
  std::vector<std::size_t> numbers;
  LoopSetup setup = config.setup;
  for (std::uint32_t i = 0; i < count; ++i) {
    setup.model = make_model<double>(config.uncertainty->plants->draw(config.uncertainty->seed, first + i));
    setup.model.smoothing = config.setup.model.smoothing;
    if (!runs_on_lanes(config, setup)) {
      run_alone(config, setup, cases, of_plant(i));
      continue;
    }
    on_lanes.push_back(setup.model);
    numbers.push_back(i);
  }
  std::vector<LoopResult> made(on_lanes.size() * cases.size());
  run_plants_on_lanes(config.setup, on_lanes, cases, made, registers_of(config));
  for (std::size_t i = 0; i < numbers.size(); ++i)
    std::copy_n(made.begin() + static_cast<std::ptrdiff_t>(i * cases.size()), cases.size(),
                of_plant(numbers[i]).begin());
  return results;
}

std::uint32_t plants_per_task(const SweepConfig& config) {
  return runs_on_lanes(config, config.setup) ? 50 : 5;
}

std::size_t sweep_group_size(const SweepConfig& config) {
  if (!runs_on_lanes(config, config.setup)) return 1;
  const std::size_t together = runs_side_by_side(registers_of(config));
  return config.setup.sampled ? together : refill_of_lanes * together;
}

std::size_t runs_per_call(const SweepConfig& config) {
  const std::size_t group = sweep_group_size(config);
  const bool more = config.setup.sampled && lanes_search(config);
  return more ? refill_of_lanes * group : group;
}

std::vector<SweepRun> run_sweep_group(const SweepConfig& config, const std::vector<LoopCase>& group) {
  std::vector<LoopResult> results(group.size());
  if (runs_on_lanes(config, config.setup))
    run_on_lanes(config.setup, group, results, registers_of(config));
  else
    run_alone(config, config.setup, group, results);
  std::vector<SweepRun> runs;
  for (std::size_t i = 0; i < group.size(); ++i) runs.push_back(run_of(group[i], results[i]));
  return runs;
}

}  // namespace upright
