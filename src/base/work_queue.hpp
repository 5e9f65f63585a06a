// A queue of work for several threads, with the first of their exceptions.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>

namespace upright {

/// Distributes indices in order to threads; none after a failure.
class WorkQueue {
 public:
  /// `stops` is called before each index; true ends the queue.
  explicit WorkQueue(std::size_t count, std::function<bool()> stops = {});

  /// The next index; none: the queue has ended.
  std::optional<std::size_t> next();
  bool is_over() const;
  /// Runs `work` for an index. An exception ends the queue and is stored.
  void guard(std::size_t number, const std::function<void()>& work);
  /// Rethrows the exception of the lowest index that failed, independent of the number of threads.
  void rethrow() const;

 private:
  bool stopped() const { return failed_ || (stops_ && stops_()); }

  const std::size_t count_;
  const std::function<bool()> stops_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> failed_{false};
  std::mutex of_failure_;
  std::size_t failed_number_ = 0;
  std::exception_ptr failure_;
};

/// Runs `worker` on this many threads, including the calling one, and waits for all of them.
void on_threads(std::size_t threads, const std::function<void()>& worker);

}  // namespace upright
