#include "parallel.hpp"

#include <atomic>
#include <cstdlib>
#include <exception>
#include <thread>
#include <vector>

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
  const std::size_t threads = std::min<std::size_t>(thread_count(), count);
  std::vector<std::exception_ptr> problems(count);
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (std::size_t i = next++; i < count && !is_interrupted(); i = next++) {
      try {
        work(i);
      } catch (...) {
        problems[i] = std::current_exception();
      }
    }
  };
  std::vector<std::thread> helpers;
  for (std::size_t t = 1; t < threads; ++t) helpers.emplace_back(run);
  run();
  for (std::thread& helper : helpers) helper.join();
  if (is_interrupted()) throw Interrupted();
  for (const std::exception_ptr& problem : problems)
    if (problem) std::rethrow_exception(problem);
}

}  // namespace upright
