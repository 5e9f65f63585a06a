#include "stop_sequence.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "upright/hal/clock.hpp"

namespace upright {

namespace {

constexpr std::int64_t first_pause_ns = 2'000'000, longest_pause_ns = 100'000'000;
/// A reply is waited for twice as long in each attempt: whatever is slow now is mostly not slow for seconds.
constexpr double longest_patience_s = 0.5;
/// A device acts on a request that it has not answered within this time, or never.
constexpr std::int64_t late_act_ns = nanoseconds_per_second, second_look_ns = 100'000'000;
/// After so many attempts the line is left alone for as long as the device's own watchdog needs: a device
/// that answers and does not obey feeds it with each of them.
constexpr int attempts_per_silence = 6;
constexpr double longest_silence_s = 2.0, silence_margin_s = 0.02, silence_share = 1.25;

bool is_exception(RigFault fault) noexcept {
  return fault == RigFault::device_refused || fault == RigFault::device_busy;
}

}  // namespace

void StopSequence::reset(bool reads_back, double watchdog_s) noexcept {
  report_ = {};
  report_.disabled = !rig_.enable_address.has_value();
  report_.watchdog_s = watchdog_s;
  reads_back_ = reads_back;
  attempts_ = 0;
  first_way_ = 0;
  looked_twice_ = false;
  next_ns_ = 0;
  link_.wait_for_replies(rig_.response_timeout_s);
}

double StopSequence::patience_s() const noexcept {
  constexpr int max_doublings = 16;
  return std::min(longest_patience_s,
                  std::ldexp(rig_.response_timeout_s, std::min(attempts_, max_doublings)));
}

std::int64_t StopSequence::pause_ns() const noexcept {
  constexpr int max_doublings = 8;
  const double watchdog_s = report_.watchdog_s;
  if (watchdog_s > 0.0 && watchdog_s <= longest_silence_s && attempts_ % attempts_per_silence == 0)
    return static_cast<std::int64_t>(1e9 * (silence_share * watchdog_s + silence_margin_s));
  return std::min(longest_pause_ns, first_pause_ns << std::min(attempts_, max_doublings));
}

void StopSequence::note(RigFault fault) noexcept {
  if (fault == RigFault::none) return;
  report_.fault = fault;
  report_.exception = is_exception(fault) ? link_.last_exception() : 0;
}

RigFault StopSequence::reach() noexcept {
  if (!link_.connected())
    if (const RigFault fault = link_.connect(patience_s()); fault != RigFault::none) return fault;
  if (!link_.in_step()) link_.await_silence(patience_s());
  return RigFault::none;
}

/// By the function that was not left without an answer yet; a device that refuses one may know another.
RigFault StopSequence::write_zero() noexcept {
  constexpr std::array ways = {ModbusFunction::read_write, ModbusFunction::write_multiple,
                               ModbusFunction::write_single};
  // 0x17 only where the file names it.
  const std::size_t known = rig_.exchange == ModbusExchange::read_write ? 0 : 1;
  const std::size_t count = ways.size() - known;
  RigFault fault = RigFault::none;
  for (std::size_t i = 0; i < count; ++i) {
    fault = link_.write_zero(ways[known + (first_way_ + i) % count]);
    if (!is_exception(fault)) break;
  }
  if (fault != RigFault::none && !is_exception(fault)) ++first_way_;
  return fault;
}

RigFault StopSequence::put_zero() noexcept {
  if (const RigFault fault = reach(); fault != RigFault::none) return fault;
  if (const RigFault fault = write_zero(); fault != RigFault::none) return fault;
  if (!reads_back_) return RigFault::none;
  double voltage_v = 0.0;
  if (const RigFault fault = link_.read_voltage(voltage_v); fault != RigFault::none) return fault;
  return voltage_v == 0.0 ? RigFault::none : RigFault::output_kept;
}

RigFault StopSequence::disable() noexcept {
  if (const RigFault fault = reach(); fault != RigFault::none) return fault;
  if (const RigFault fault = link_.write_register(*rig_.enable_address, 0); fault != RigFault::none)
    return fault;
  int value = 0;
  const RigFault fault = link_.read_register(*rig_.enable_address, value);
  // A register that cannot be read has acknowledged.
  if (fault == RigFault::device_refused) return RigFault::none;
  return fault == RigFault::none && value != 0 ? RigFault::output_kept : fault;
}

void StopSequence::attempt() noexcept {
  link_.wait_for_replies(patience_s());
  if (!report_.zero_confirmed) {
    const RigFault fault = put_zero();
    note(fault);
    // Requests from before that were left without an answer may still be on their way, with another voltage.
    const bool doubtful = monotonic_ns() - link_.last_unanswered_ns() < late_act_ns && !looked_twice_;
    if (fault == RigFault::none && doubtful) {
      looked_twice_ = true;
      next_ns_ = monotonic_ns() + second_look_ns;
    } else {
      looked_twice_ = looked_twice_ && fault == RigFault::none;
      report_.read_back = reads_back_ && fault == RigFault::none;
      report_.zero_confirmed = fault == RigFault::none;
    }
  }
  if (!report_.disabled) {
    const RigFault fault = disable();
    note(fault);
    report_.disabled = fault == RigFault::none;
  }
  ++attempts_;
  next_ns_ = std::max(next_ns_, monotonic_ns() + pause_ns());
}

}  // namespace upright
