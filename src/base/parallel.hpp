// Parallel loops. Results must not depend on the number of cores: each index writes its own element.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>

namespace upright {

/// A signal interrupted the work.
class Interrupted : public std::exception {
 public:
  const char* what() const noexcept override { return "interrupted"; }
};

/// While an object exists, parallel_for ends with Interrupted when `signal` is nonzero; the flag is
/// tested before each index. Null: never. One object at a time.
class InterruptibleWork {
 public:
  explicit InterruptibleWork(const std::atomic<int>* signal);
  ~InterruptibleWork();
  InterruptibleWork(const InterruptibleWork&) = delete;
  InterruptibleWork& operator=(const InterruptibleWork&) = delete;
};

/// Number of threads: the machine's cores, or the value of UPRIGHT_THREADS.
unsigned thread_count();

/// Calls work(i) for i in [0, count) on all cores; rethrows the first exception in index order. Throws
/// Interrupted after a signal (see InterruptibleWork); some indices were then not processed.
void parallel_for(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace upright
