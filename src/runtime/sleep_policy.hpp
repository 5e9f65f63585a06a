// The schedule of cycles and the wait for the next one: free functions on a small state, which tests can
// run without the machine's clock.
#pragma once

#include <cstdint>

#include "upright/hal/clock.hpp"

namespace upright {

/// Cycles are due at start + tick x period: an overrun does not shift the phase.
struct LoopPhase {
  std::int64_t start_ns = 0;    ///< time of the first period [ns]
  std::int64_t period_ns = 1;   ///< length of a period [ns]
  std::uint64_t next_tick = 0;  ///< number of the next period

  /// When a period begins [ns].
  std::int64_t due_ns(std::uint64_t tick) const noexcept {
    return start_ns + static_cast<std::int64_t>(tick) * period_ns;
  }
};

/// One wake-up.
struct Wake {
  std::uint64_t tick = 0;    ///< the cycle to run now
  std::uint64_t missed = 0;  ///< cycles that were due before it and are skipped
  std::int64_t late_ns = 0;  ///< lateness relative to the earliest of them
};

/// The cycle to run at `now_ns`, the time at which the loop woke or finished a long cycle. After a delay
/// only the latest due cycle is run; the skipped ones are counted and not made up for.
inline Wake wake_at(LoopPhase& phase, std::int64_t now_ns) noexcept {
  Wake wake;
  const std::int64_t due = phase.due_ns(phase.next_tick);
  wake.late_ns = now_ns > due ? now_ns - due : 0;
  wake.missed = static_cast<std::uint64_t>(wake.late_ns / phase.period_ns);
  wake.tick = phase.next_tick + wake.missed;
  phase.next_tick = wake.tick + 1;
  return wake;
}

/// Sleeps until `spin_ns` before `due_ns`, then polls the clock until it is due, which avoids the wake-up
/// latency of the kernel. Returns the present time. It is earlier than `due_ns` only when a signal ended
/// the sleep, or `given_up()` the polling.
template <class GivenUp>
std::int64_t wait_until_due(Clock& clock, std::int64_t due_ns, std::int64_t spin_ns,
                            const GivenUp& given_up) noexcept {
  const std::int64_t spin_from_ns = due_ns - spin_ns;
  clock.sleep_until(spin_from_ns);
  std::int64_t now_ns = clock.now_ns();
  while (now_ns >= spin_from_ns && now_ns < due_ns && !given_up()) now_ns = clock.now_ns();
  return now_ns;
}

}  // namespace upright
