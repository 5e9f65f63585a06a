// How a Modbus device is brought to zero volts: tried again and again, by every function it may know, over
// new connections, and believed once its output reads zero where it can be read.
#pragma once

#include <cstdint>

#include "link.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// Belongs to the thread that has the link. Zero volts and the amplifier's disabling are tried independently.
class StopSequence {
 public:
  StopSequence(ModbusLink& link, const ModbusRig& rig) : link_(link), rig_(rig) {}

  /// Forgets an earlier stop. `reads_back`: the device answers when its voltage registers are read.
  /// `watchdog_s` is the device's own, 0: none.
  void reset(bool reads_back, double watchdog_s) noexcept;
  /// One attempt: some exchanges, each with its time-out. Not before `next_ns`.
  void attempt() noexcept;
  /// When the next attempt is due, on the monotonic clock.
  std::int64_t next_ns() const noexcept { return next_ns_; }
  const StopReport& report() const noexcept { return report_; }

 private:
  RigFault reach() noexcept;
  RigFault write_zero() noexcept;
  RigFault put_zero() noexcept;
  RigFault disable() noexcept;
  void note(RigFault fault) noexcept;
  double patience_s() const noexcept;
  std::int64_t pause_ns() const noexcept;

  ModbusLink& link_;
  const ModbusRig& rig_;
  StopReport report_;
  bool reads_back_ = false;
  int attempts_ = 0;
  std::size_t first_way_ = 0;  // which function is tried first
  bool looked_twice_ = false;
  std::int64_t next_ns_ = 0;
};

}  // namespace upright
