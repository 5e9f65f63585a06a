// When the next cycle is due, and how to wait for it: free functions over a small state, so that they can be
// tested without the machine's clock.
#pragma once

#include <cstdint>

#include "upright/hal/clock.hpp"

namespace upright {

/// Cycles are due at start + tick x period, for ever: an overrun never moves the phase.
struct LoopPhase {
  std::int64_t start_ns = 0;
  std::int64_t period_ns = 1;
  std::uint64_t next_tick = 0;

  std::int64_t due_ns(std::uint64_t tick) const noexcept {
    return start_ns + static_cast<std::int64_t>(tick) * period_ns;
  }
};

struct Wake {
  std::uint64_t tick = 0;    ///< the cycle to run now
  std::uint64_t missed = 0;  ///< cycles that were due before it and will never run
  std::int64_t late_ns = 0;  ///< after the time the earliest of them was due
};

/// The cycle to run at `now_ns`, the time at which the loop woke or came back from a long cycle. A late cycle
/// runs once, as the latest one that is due; those it overtook are counted, never made up for.
inline Wake wake_at(LoopPhase& phase, std::int64_t now_ns) noexcept {
  Wake wake;
  const std::int64_t due = phase.due_ns(phase.next_tick);
  wake.late_ns = now_ns > due ? now_ns - due : 0;
  wake.missed = static_cast<std::uint64_t>(wake.late_ns / phase.period_ns);
  wake.tick = phase.next_tick + wake.missed;
  phase.next_tick = wake.tick + 1;
  return wake;
}

/// Sleeps until `spin_ns` before `due_ns` and then looks at the clock until it is due: who is awake already
/// is not late by the time that the kernel takes to wake a thread. Returns the time. It is before `due_ns`
/// only when a signal ended the sleep, or `given_up()` the spinning.
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
