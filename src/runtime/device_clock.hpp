// When the next cycle is due where the rig's device samples on its own time: the phase follows its samples.
#pragma once

#include <algorithm>
#include <cstdint>

#include "sleep_policy.hpp"
#include "upright/hal/rig.hpp"
#include "upright/record/timing_stats.hpp"

namespace upright {

/// Samples arrive when they were taken or later, for links and threads delay them. So a sample is the one of
/// the cycle that is due where it comes up to a quarter of a period before or three quarters after. What is
/// not there by then was lost, or comes so late that it is as good as lost.
class DeviceClock {
 public:
  static constexpr std::int64_t parts = 4;       ///< of a period
  static constexpr std::int64_t parts_late = 3;  ///< by which a sample may be late

  /// Until when the sample of the next cycle is waited for.
  static std::int64_t patience_ends_ns(const LoopPhase& phase) noexcept {
    return phase.due_ns(phase.next_tick) + parts_late * phase.period_ns / parts;
  }

  /// Moves the phase to where the samples come. The first sample is that of the next cycle, whenever it
  /// comes. False: the sample is that of a cycle that has run without it.
  bool take(const DeviceSample& sample, LoopPhase& phase) noexcept {
    if (first_.number == 0) {
      phase.start_ns += sample.time_ns - phase.due_ns(phase.next_tick);
      first_ = sample;
      first_tick_ = static_cast<std::int64_t>(phase.next_tick);
    }
    const std::int64_t after_due_ns = sample.time_ns - phase.due_ns(phase.next_tick);
    const std::int64_t early_ns = phase.period_ns / parts;
    const std::int64_t cycles = floored(after_due_ns + early_ns, phase.period_ns);
    // One that comes early shows when samples are taken, one that comes late mostly how it was delayed.
    constexpr std::int64_t follows_early = 2, follows_late = 8;
    const std::int64_t off_ns = after_due_ns - cycles * phase.period_ns;
    phase.start_ns += off_ns / (off_ns < 0 ? follows_early : follows_late);
    last_number_ = sample.number;
    last_tick_ = static_cast<std::int64_t>(phase.next_tick) + cycles;
    last_due_ns_ = phase.due_ns(static_cast<std::uint64_t>(last_tick_));
    if (settled_tick_ == 0 && sample.number - first_.number >= samples_until_settled) {
      settled_tick_ = last_tick_;
      settled_due_ns_ = last_due_ns_;
    }
    return cycles >= 0;
  }

  /// The cycle of the sample that was taken last, which begins at `now_ns`. Cycles that were due before it
  /// are counted, never made up for.
  Wake wake(LoopPhase& phase, std::int64_t now_ns) const noexcept {
    Wake wake;
    wake.late_ns = std::max<std::int64_t>(0, now_ns - phase.due_ns(phase.next_tick));
    wake.tick = static_cast<std::uint64_t>(last_tick_);
    wake.missed = wake.tick - phase.next_tick;
    phase.next_tick = wake.tick + 1;
    return wake;
  }

  /// What is known of the device's clock so far.
  DeviceTiming timing(std::int64_t nominal_period_ns) const noexcept {
    DeviceTiming timing;
    if (first_.number == 0) return timing;
    const std::int64_t periods = last_tick_ - first_tick_;
    timing.samples = last_number_ - first_.number + 1;
    timing.lost = static_cast<std::uint64_t>(
        std::max<std::int64_t>(0, periods + 1 - static_cast<std::int64_t>(timing.samples)));
    // The phase is where samples come on average: a single late one does not show as drift.
    const bool is_settled = settled_tick_ > 0 && settled_tick_ < last_tick_;
    const std::int64_t from_tick = is_settled ? settled_tick_ : first_tick_;
    const std::int64_t from_ns = is_settled ? settled_due_ns_ : first_.time_ns;
    if (last_tick_ <= from_tick) return timing;
    timing.period_s =
        1e-9 * static_cast<double>(last_due_ns_ - from_ns) / static_cast<double>(last_tick_ - from_tick);
    timing.drift_ppm = 1e6 * (timing.period_s / (1e-9 * static_cast<double>(nominal_period_ns)) - 1.0);
    return timing;
  }

 private:
  static constexpr std::int64_t floored(std::int64_t part, std::int64_t whole) noexcept {
    return part / whole - (part % whole < 0 ? 1 : 0);
  }

  /// The phase has forgotten by then when the first sample came.
  static constexpr std::uint64_t samples_until_settled = 64;

  DeviceSample first_;
  std::uint64_t last_number_ = 0;
  std::int64_t first_tick_ = 0, last_tick_ = 0, settled_tick_ = 0;
  std::int64_t last_due_ns_ = 0, settled_due_ns_ = 0;  // by the phase
};

}  // namespace upright
