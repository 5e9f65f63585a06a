// Finds the times at which the machine did not let this process run: a host that takes a virtual machine's
// processors away, or other programs that keep them.
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

/// Tells a stall from the lateness that every machine has, by the wakes of a periodic sleeper.
class LateWakes {
 public:
  static constexpr double period_s = 0.001;
  /// Two periods of the slowest loops under test: from here on they miss cycles.
  static constexpr double stall_s = 0.010;

  /// The sleeper woke at `now_s`. The stall that it is in, from its begin until now; its begin names it.
  std::optional<Interval> woke(double now_s);

 private:
  static constexpr double unavoidable_s = 0.001;
  /// A processor that others use, or a host that deals it out, is given in slices: late wakes no farther
  /// apart than this, a period of those loops, belong together.
  static constexpr double apart_s = 0.005;

  double last_wake_s_ = 0.0;
  double begin_s_ = 0.0, end_s_ = 0.0;  ///< of late wakes that belong together
  double lost_s_ = 0.0;                 ///< by which they were late in all
};

/// Watches the machine from its making to its end: each processor, with a sleeper of the priority of who
/// makes it, and pseudo-terminals, whose bytes a thread of the kernel carries. On a busy machine that one
/// was late by up to 31 ms while sleepers woke within 2 ms.
class StallDetector {
 public:
  StallDetector();
  ~StallDetector();
  StallDetector(const StallDetector&) = delete;
  StallDetector& operator=(const StallDetector&) = delete;

  /// A stall, of any of them, that overlaps `when`; the longest one. Waits until all that happened before
  /// now is known.
  std::optional<Interval> stall_in(const Interval& when) const;

 private:
  class SerialLine;
  class Watcher;
  std::vector<std::unique_ptr<Watcher>> watchers_;
};

}  // namespace upright::test
