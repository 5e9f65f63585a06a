// Finds stalls: times at which this process could not run, because a host took the processors of a virtual
// machine away or other programs occupied them.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

namespace upright::test {

/// From one time to another, in seconds on the monotonic clock.
struct Interval {
  double begin_s = 0.0, end_s = 0.0;
  bool overlaps(const Interval& other) const { return begin_s <= other.end_s && other.begin_s <= end_s; }
};

/// Distinguishes stalls from normal wake-up latency by the wakes of a periodic sleeper.
class LateWakes {
 public:
  static constexpr double period_s = 0.001;
  /// Two periods of the slowest loops under test. With a longer delay they miss cycles.
  static constexpr double stall_s = 0.010;

  /// The sleeper woke at `now_s`. Returns the present stall from its begin until now; the begin identifies
  /// it.
  std::optional<Interval> woke(double now_s);

 private:
  static constexpr double unavoidable_s = 0.001;
  /// A shared processor is assigned in time slices. Late wakes that are closer together than this, a period
  /// of those loops, belong to one stall.
  static constexpr double apart_s = 0.005;

  double last_wake_s_ = 0.0;
  double begin_s_ = 0.0, end_s_ = 0.0;  ///< of late wakes that belong together
  double lost_s_ = 0.0;                 ///< their total latency
};

/// Monitors the machine during its lifetime: each processor, with a sleeper of the priority of the caller,
/// and pseudo-terminals, whose bytes a kernel thread transfers. On a busy machine this thread was up to 31 ms
/// late while the sleepers woke within 2 ms.
class StallDetector {
 public:
  StallDetector();
  ~StallDetector();
  StallDetector(const StallDetector&) = delete;
  StallDetector& operator=(const StallDetector&) = delete;

  /// The longest stall of any of them that overlaps `when`. Waits until everything before now is known.
  std::optional<Interval> stall_in(const Interval& when) const;

 private:
  class SerialLine;
  class Watcher;
  std::vector<std::unique_ptr<Watcher>> watchers_;
};

}  // namespace upright::test
