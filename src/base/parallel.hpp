// Work spread over the cores. Results must not depend on how many there are: each index writes its own place.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>

namespace upright {

/// Work was given up because a signal asked for it.
class Interrupted : public std::exception {
 public:
  const char* what() const noexcept override { return "interrupted"; }
};

/// While one lives, parallel_for gives up with Interrupted as soon as `signal` is not zero: before its next
/// index, so within what one index takes. Null: never. One at a time.
class InterruptibleWork {
 public:
  explicit InterruptibleWork(const std::atomic<int>* signal);
  ~InterruptibleWork();
  InterruptibleWork(const InterruptibleWork&) = delete;
  InterruptibleWork& operator=(const InterruptibleWork&) = delete;
};

/// Threads to use: the machine's cores, or what UPRIGHT_THREADS says.
unsigned thread_count();

/// Calls work(i) for i in [0, count) on all cores; rethrows the first exception in index order. Throws
/// Interrupted when InterruptibleWork says so; not every index was worked on then.
void parallel_for(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace upright
