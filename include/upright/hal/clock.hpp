// The clock that a loop and its rig share: the machine's monotonic clock, or a virtual one.
#pragma once

#include <time.h>

#include <cstdint>

namespace upright {

inline constexpr std::int64_t nanoseconds_per_second = 1'000'000'000;  ///< to convert times

/// Time of CLOCK_MONOTONIC.
inline std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * nanoseconds_per_second + now.tv_nsec;
}

/// The time that a loop follows.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t now_ns() noexcept = 0;  ///< the time now [ns]
  /// Returns at `time_ns` or later; earlier only after a signal.
  virtual void sleep_until(std::int64_t time_ns) noexcept = 0;
  /// True when time advances only in `sleep_until`: the loop may wait for its log; runs are repeatable.
  virtual bool is_virtual() const noexcept = 0;
};

/// CLOCK_MONOTONIC, absolute sleeps.
class MonotonicClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override { return monotonic_ns(); }  ///< time of CLOCK_MONOTONIC [ns]
  void sleep_until(std::int64_t time_ns) noexcept override {
    timespec until{};
    until.tv_sec = time_ns / nanoseconds_per_second;
    until.tv_nsec = time_ns % nanoseconds_per_second;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
  }
  bool is_virtual() const noexcept override { return false; }
};

/// Advances only when requested; never goes back.
class VirtualClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override { return now_ns_; }  ///< the time to which it was advanced [ns]
  void sleep_until(std::int64_t time_ns) noexcept override {
    if (time_ns > now_ns_) now_ns_ = time_ns;
  }
  bool is_virtual() const noexcept override { return true; }

 private:
  std::int64_t now_ns_ = 0;
};

}  // namespace upright
