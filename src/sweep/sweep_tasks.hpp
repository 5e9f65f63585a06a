// The tasks of a sweep and what comes of them, as numbers: so they go through threads, MPI and the journal.
#pragma once

#include "sweep.hpp"
#include "transition_search.hpp"

namespace upright {

/// Runs of the sweep's plant from these starts.
SweepNumbers plain_task(std::span<const LoopCase> cases);
/// Runs of the drawn plants `first_plant` and following from these starts, of which only counts are kept.
SweepNumbers plants_task(std::span<const LoopCase> cases, std::uint32_t first_plant, std::uint32_t plants);

/// The runs of these searches, from the list of delays to their ends. Only where `lanes_search`.
SweepNumbers search_task(std::span<const StartSearch> searches);

/// Whether a task can search: its lanes take the next run of any of its searches as soon as one has ended.
bool lanes_search(const SweepConfig& config);
/// How many searches a task should have, so that few lanes are empty.
std::size_t starts_per_search(const SweepConfig& config);

/// The runs of `count` drawn plants from number `first` on, each from all of these starts: by plant, then
/// start.
std::vector<LoopResult> run_plants(const SweepConfig& config, std::uint32_t first, std::uint32_t count,
                                   std::span<const LoopCase> cases);

/// How many runs one call of the lanes should have, so that few of them are empty.
std::size_t runs_per_call(const SweepConfig& config);

/// What comes of a task of any kind. Depends on nothing else.
SweepNumbers compute_task(const SweepConfig& config, const SweepNumbers& task);

/// The runs that came of a plain task or a search; empty where the numbers are not those of runs.
std::vector<SweepRun> runs_of(const SweepNumbers& result);
/// The counts that came of a task over plants, by start; empty where the numbers are damaged or of another
/// task.
std::vector<PlantCounts> counts_of(const SweepNumbers& task, const SweepNumbers& result);

/// How many plants a task runs: enough that messages and the journal cost little, few enough that Ctrl-C is
/// answered soon.
std::uint32_t plants_per_task(const SweepConfig& config);

}  // namespace upright
