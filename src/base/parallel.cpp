#include "parallel.hpp"

#include <algorithm>
#include <cstdlib>
#include <thread>

#include "work_queue.hpp"

namespace upright {

namespace {

std::atomic<const std::atomic<int>*> interrupting_signal{nullptr};

bool is_interrupted() {
  const std::atomic<int>* signal = interrupting_signal.load(std::memory_order_relaxed);
  return signal != nullptr && signal->load(std::memory_order_relaxed) != 0;
}

}  // namespace

InterruptibleWork::InterruptibleWork(const std::atomic<int>* signal) {
  interrupting_signal = signal;
}

InterruptibleWork::~InterruptibleWork() {
  interrupting_signal = nullptr;
}

unsigned thread_count() {
  static const unsigned count = [] {
    const char* text = std::getenv("UPRIGHT_THREADS");
    const int wanted = text != nullptr ? std::atoi(text) : 0;
    return wanted > 0 ? static_cast<unsigned>(wanted) : std::max(1u, std::thread::hardware_concurrency());
  }();
  return count;
}

void parallel_for(std::size_t count, const std::function<void(std::size_t)>& work) {
  WorkQueue queue(count, is_interrupted);
  on_threads(std::min<std::size_t>(thread_count(), count), [&] {
    while (const std::optional<std::size_t> i = queue.next()) queue.guard(*i, [&] { work(*i); });
  });
  if (is_interrupted()) throw Interrupted();
  queue.rethrow();
}

}  // namespace upright
