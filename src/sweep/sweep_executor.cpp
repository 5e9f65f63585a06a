#include <algorithm>
#include <mutex>
#include <thread>

#include "base/work_queue.hpp"
#include "sim/loop/fast_loop.hpp"
#include "sweep.hpp"

namespace upright {

namespace {

bool runs_on_lanes(const SweepConfig& config) {
  return config.engine != SweepEngine::reference && lanes_can_run(config.setup);
}

LaneRegisters registers_of(const SweepConfig& config) {
  return config.engine == SweepEngine::fast ? LaneRegisters::wide : LaneRegisters::baseline;
}

}  // namespace

std::size_t sweep_group_size(const SweepConfig& config) {
  if (!runs_on_lanes(config)) return 1;
  const std::size_t together = runs_side_by_side(registers_of(config));
  // Lanes of continuous loops go on with the next run when they end, so that more of them waste less.
  return config.setup.sampled ? together : 4 * together;
}

std::vector<SweepRun> run_sweep_group(const SweepConfig& config, const SweepExecutor::Group& group) {
  std::vector<LoopResult> results(group.size());
  if (runs_on_lanes(config)) {
    run_on_lanes(config.setup, group, results, registers_of(config));
  } else {
    for (std::size_t i = 0; i < group.size(); ++i)
      results[i] = config.engine == SweepEngine::reference ? run_with_reference(config.setup, group[i])
                                                           : run_with_events(config.setup, group[i]);
  }
  std::vector<SweepRun> runs;
  for (std::size_t i = 0; i < group.size(); ++i)
    runs.push_back(
        {group[i], results[i].fall_time_s, results[i].theta_amplitude_rad, results[i].cart_amplitude_m});
  return runs;
}

namespace {

class ThreadExecutor final : public SweepExecutor {
 public:
  ThreadExecutor(const SweepConfig& config, unsigned threads)
      : config_(config),
        threads_(threads != 0 ? threads : std::max(1u, std::thread::hardware_concurrency())) {}

  void run(const std::vector<Group>& groups, const Done& done, const std::atomic<bool>* stop) override {
    WorkQueue queue(groups.size(), [stop] { return stop && *stop; });
    std::mutex one_at_a_time;
    on_threads(std::min<std::size_t>(threads_, groups.size()), [&] {
      while (const std::optional<std::size_t> mine = queue.next())
        queue.guard(*mine, [&] {
          const std::vector<SweepRun> runs = run_sweep_group(config_, groups[*mine]);
          const std::lock_guard lock(one_at_a_time);
          done(*mine, runs);
        });
    });
    queue.rethrow();
  }

 private:
  const SweepConfig& config_;
  unsigned threads_;
};

}  // namespace

std::unique_ptr<SweepExecutor> make_thread_executor(const SweepConfig& config, unsigned threads) {
  return std::make_unique<ThreadExecutor>(config, threads);
}

}  // namespace upright
