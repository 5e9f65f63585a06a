// Work handed out in order to threads, and the first of their failures.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>

namespace upright {

/// Numbers of pieces of work, handed out in order to whoever asks; none after one of them has failed.
class WorkQueue {
 public:
  /// `stops`, asked before each number: nothing more is handed out.
  explicit WorkQueue(std::size_t count, std::function<bool()> stops = {});

  /// The next number; none: nothing is left to be done.
  std::optional<std::size_t> next();
  bool is_over() const;
  /// Does `work` of that number. What it throws ends the queue, and is kept.
  void guard(std::size_t number, const std::function<void()>& work);
  /// The exception of the lowest number that failed, which does not depend on how many threads there were.
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

/// Calls `worker` on so many threads, of which the caller's is one, and waits for all of them.
void on_threads(std::size_t threads, const std::function<void()>& worker);

}  // namespace upright
