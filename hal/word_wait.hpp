// Sleeping on a word in memory until another thread has changed it.
#pragma once

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>

#include "upright/hal/clock.hpp"

namespace upright {

/// Sleeps while `word` is `value`, until woken or until `until_ns` of the monotonic clock.
inline void wait_while(const std::atomic<std::uint32_t>& word, std::uint32_t value,
                       std::int64_t until_ns) noexcept {
  static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t));
  const timespec until{until_ns / nanoseconds_per_second, until_ns % nanoseconds_per_second};
  syscall(SYS_futex, &word, FUTEX_WAIT_BITSET_PRIVATE, value, &until, nullptr, FUTEX_BITSET_MATCH_ANY);
}

/// Wakes one thread that sleeps on `word`.
inline void wake_one(const std::atomic<std::uint32_t>& word) noexcept {
  syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
}

}  // namespace upright
