#include "mpi_executor.hpp"

#include <cstdlib>

#include "upright/base/error.hpp"

#ifdef UPRIGHT_WITH_MPI
#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <optional>
#include <thread>

#include "base/work_queue.hpp"
#include "sweep_tasks.hpp"
#endif

namespace upright {

namespace {

bool started_by_mpirun() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"})
    if (std::getenv(name) != nullptr) return true;  // NOLINT(concurrency-mt-unsafe): before any thread
  return false;
}

}  // namespace

#ifdef UPRIGHT_WITH_MPI

namespace {

enum Tag : int { work_tag = 1, result_tag = 2, end_tag = 3 };
constexpr auto patience = std::chrono::microseconds(200);  // between looks for a message; a wait would spin

void send(int rank, Tag tag, const std::vector<double>& numbers) {
  MPI_Send(numbers.data(), static_cast<int>(numbers.size()), MPI_DOUBLE, rank, tag, MPI_COMM_WORLD);
}

/// A message from a rank (or any), when there is one.
bool receive(int from, std::vector<double>& numbers, MPI_Status& status) {
  int there = 0;
  MPI_Iprobe(from, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return false;
  int count = 0;
  MPI_Get_count(&status, MPI_DOUBLE, &count);
  numbers.resize(static_cast<std::size_t>(count));
  MPI_Recv(numbers.data(), count, MPI_DOUBLE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD, &status);
  return true;
}

/// Tasks or their results one after the other: for each its number, its size, and its numbers.
void append(std::vector<double>& message, std::size_t number, const SweepNumbers& numbers) {
  message.push_back(static_cast<double>(number));
  message.push_back(static_cast<double>(numbers.size()));
  message.insert(message.end(), numbers.begin(), numbers.end());
}

/// Calls `take` for each of them.
template <class Take>
void for_each_in(const std::vector<double>& message, const Take& take) {
  for (auto at = message.begin(); at != message.end();) {
    const auto number = static_cast<std::size_t>(at[0]);
    const auto end = at + 2 + static_cast<std::ptrdiff_t>(at[1]);
    take(number, SweepNumbers(at + 2, end));
    at = end;
  }
}

class RankExecutor final : public SweepExecutor {
 public:
  RankExecutor(const SweepConfig& config, int ranks, unsigned threads)
      : config_(config), threads_(threads), idle_(static_cast<std::size_t>(ranks), true) {
    idle_[0] = false;
  }

  ~RankExecutor() override {
    std::vector<double> message;
    MPI_Status status;
    while (std::count(idle_.begin(), idle_.end(), true) + 1 < static_cast<std::ptrdiff_t>(idle_.size())) {
      if (receive(MPI_ANY_SOURCE, message, status))
        idle_[static_cast<std::size_t>(status.MPI_SOURCE)] = true;
      else
        std::this_thread::sleep_for(patience);
    }
    for (std::size_t rank = 1; rank < idle_.size(); ++rank) send(static_cast<int>(rank), end_tag, {});
  }

  void run(std::size_t count, const TaskOf& task_of, const Done& done,
           const std::atomic<bool>* stop) override {
    WorkQueue queue(count, [stop] { return stop && *stop; });
    std::mutex one_at_a_time;
    std::size_t away = 0;
    const auto compute_locally = [&] {
      while (const std::optional<std::size_t> mine = queue.next())
        queue.guard(*mine, [&] {
          const SweepNumbers result = compute_task(config_, task_of(*mine));
          const std::lock_guard lock(one_at_a_time);
          done(*mine, result);
        });
    };
    {
      std::vector<std::jthread> here;
      for (unsigned i = 0; i < threads_; ++i) here.emplace_back(compute_locally);
      // MPI is called from this thread only.
      while (away > 0 || !queue.is_over()) {
        for (std::size_t rank = 1; rank < idle_.size(); ++rank)
          if (idle_[rank] && send_tasks(rank, task_of, queue)) ++away;
        std::vector<double> message;
        MPI_Status status;
        if (!receive(MPI_ANY_SOURCE, message, status)) {
          std::this_thread::sleep_for(patience);
          continue;
        }
        idle_[static_cast<std::size_t>(status.MPI_SOURCE)] = true;
        --away;
        queue.guard(count, [&] {
          for_each_in(message, [&](std::size_t number, const SweepNumbers& result) {
            const std::lock_guard lock(one_at_a_time);
            done(number, result);
          });
        });
      }
    }
    queue.rethrow();
  }

 private:
  /// Gives a rank as many tasks as it has threads. False: none are left.
  bool send_tasks(std::size_t rank, const TaskOf& task_of, WorkQueue& queue) {
    std::vector<double> message;
    for (unsigned i = 0; i < threads_; ++i) {
      const std::optional<std::size_t> number = queue.next();
      if (!number) break;
      append(message, *number, task_of(*number));
    }
    if (message.empty()) return false;
    send(static_cast<int>(rank), work_tag, message);
    idle_[rank] = false;
    return true;
  }

  const SweepConfig& config_;
  unsigned threads_;
  std::vector<bool> idle_;
};

}  // namespace

MpiExecutor::MpiExecutor() {
  if (!started_by_mpirun()) return;
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &count_);
}

MpiExecutor::~MpiExecutor() {
  int initialized = 0;
  MPI_Initialized(&initialized);
  if (initialized != 0) MPI_Finalize();
}

int MpiExecutor::first_failed(bool failed) const {
  const int mine = failed ? rank_ : count_;
  if (count_ == 1) return mine;
  int lowest = count_;
  MPI_Allreduce(&mine, &lowest, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  return lowest;
}

std::unique_ptr<SweepExecutor> MpiExecutor::make_executor(const SweepConfig& config, unsigned threads) const {
  if (count_ == 1) return make_thread_executor(config, threads);
  return std::make_unique<RankExecutor>(config, count_, std::max(1u, threads));
}

void MpiExecutor::serve(const SweepConfig& config, unsigned threads) const {
  const std::unique_ptr<SweepExecutor> executor = make_thread_executor(config, std::max(1u, threads));
  std::vector<double> message;
  MPI_Status status;
  while (true) {
    if (!receive(0, message, status)) {
      std::this_thread::sleep_for(patience);
      continue;
    }
    if (status.MPI_TAG == end_tag) return;
    std::vector<std::size_t> numbers;
    std::vector<SweepNumbers> tasks;
    for_each_in(message, [&](std::size_t number, SweepNumbers task) {
      numbers.push_back(number);
      tasks.push_back(std::move(task));
    });
    std::vector<double> reply;
    executor->run(
        tasks.size(), [&](std::size_t task) { return tasks[task]; },
        [&](std::size_t task, const SweepNumbers& result) { append(reply, numbers[task], result); }, nullptr);
    send(0, result_tag, reply);
  }
}

#else

MpiExecutor::MpiExecutor() {
  if (started_by_mpirun())
    throw ConfigError(
        "this program was built without MPI: install libopenmpi-dev and build again, or start it without "
        "mpirun");
}
MpiExecutor::~MpiExecutor() = default;

int MpiExecutor::first_failed(bool failed) const {
  return failed ? rank_ : count_;
}

std::unique_ptr<SweepExecutor> MpiExecutor::make_executor(const SweepConfig& config, unsigned threads) const {
  return make_thread_executor(config, threads);
}

void MpiExecutor::serve(const SweepConfig&, unsigned) const {}

#endif

}  // namespace upright
