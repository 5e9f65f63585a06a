#include "work_queue.hpp"

#include <thread>
#include <utility>
#include <vector>

namespace upright {

WorkQueue::WorkQueue(std::size_t count, std::function<bool()> stops)
    : count_(count), stops_(std::move(stops)) {}

std::optional<std::size_t> WorkQueue::next() {
  if (stopped()) return std::nullopt;
  const std::size_t number = next_++;
  if (number >= count_) return std::nullopt;
  return number;
}

bool WorkQueue::is_over() const {
  return stopped() || next_ >= count_;
}

void WorkQueue::guard(std::size_t number, const std::function<void()>& work) {
  try {
    work();
  } catch (...) {
    const std::lock_guard lock(of_failure_);
    if (!failure_ || number < failed_number_) {
      failure_ = std::current_exception();
      failed_number_ = number;
    }
    failed_ = true;
  }
}

void WorkQueue::rethrow() const {
  if (failure_) std::rethrow_exception(failure_);
}

void on_threads(std::size_t threads, const std::function<void()>& worker) {
  std::vector<std::jthread> others;
  for (std::size_t i = 1; i < threads; ++i) others.emplace_back(worker);
  worker();
}

}  // namespace upright
