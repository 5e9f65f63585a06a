#include <algorithm>
#include <mutex>
#include <optional>
#include <thread>

#include "base/work_queue.hpp"
#include "sweep_tasks.hpp"

namespace upright {

namespace {

class ThreadExecutor final : public SweepExecutor {
 public:
  ThreadExecutor(const SweepConfig& config, unsigned threads)
      : config_(config),
        threads_(threads != 0 ? threads : std::max(1u, std::thread::hardware_concurrency())) {}

  void run(std::size_t count, const TaskOf& task_of, const Done& done,
           const std::atomic<bool>* stop) override {
    WorkQueue queue(count, [stop] { return stop && *stop; });
    std::mutex one_at_a_time;
    on_threads(std::min<std::size_t>(threads_, count), [&] {
      while (const std::optional<std::size_t> mine = queue.next())
        queue.guard(*mine, [&] {
          const SweepNumbers result = compute_task(config_, task_of(*mine));
          const std::lock_guard lock(one_at_a_time);
          done(*mine, result);
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
