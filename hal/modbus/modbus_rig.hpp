// A rig behind a Modbus link. A thread of its own talks to the device; the loop hands it requests and takes
// answers through atomics and a futex, so that a slow device can make a reading late but never the loop.
//
// What goes out when: read() is one exchange, and write() starts another that carries the voltage just
// computed, at once. So a row's voltage acts right after its reading, as the interface says, and not one
// period later, which is what a single exchange per period would mean. With function 0x17 both exchanges
// carry both directions: that of read() repeats the voltage that is already on, which also keeps the device's
// watchdog fed when a write was lost.
//
// In a joined rig the device has a part of this only. As encoders it is never sent a voltage but zero, and
// with separate exchanges none at all; as output its readings have no counts and show that it answers.
#pragma once

#include <atomic>
#include <thread>

#include "../rig_lock.hpp"
#include "link.hpp"
#include "upright/hal/rig.hpp"

namespace upright {

class ModbusTransport final : public Rig {
 public:
  ModbusTransport(const RigFile& rig, double period_s);
  ~ModbusTransport() override;
  ModbusTransport(const ModbusTransport&) = delete;
  ModbusTransport& operator=(const ModbusTransport&) = delete;

  void open() override;
  RigReading read() noexcept override;
  RigFault write(double voltage_v) noexcept override;
  void stop() noexcept override;

 private:
  void end_thread() noexcept;
  void serve() noexcept;
  void serve_read(std::uint32_t number) noexcept;
  void serve_write() noexcept;
  void serve_stop() noexcept;
  RigFault ready() noexcept;
  RigFault other_device(int& in_a_row) noexcept;
  static RigFault certain(RigFault fault, int& refusals_in_a_row) noexcept;
  RigFault verify() noexcept;
  RigFault same_device(const DeviceReading& reading) noexcept;
  void ring() noexcept;
  [[noreturn]] void fail(RigFault fault, const std::string& doing);

  RigFile rig_;
  RigRoles roles_;
  bool writes_;  // a voltage, be it always zero
  RigLock lock_;
  std::int64_t patience_ns_;  // how long read() waits at most
  ModbusLink link_;
  std::thread thread_;

  // From the loop to the thread.
  std::atomic<std::uint32_t> doorbell_{0};
  std::atomic<std::uint32_t> read_wanted_{0};
  std::atomic<std::uint32_t> write_wanted_{0};
  std::atomic<double> voltage_v_{0.0};
  std::atomic<bool> stopping_{false};
  std::atomic<bool> ending_{false};
  // From the thread to the loop. `reading_` is written before `answered_` is, and only for a request not yet
  // answered.
  std::atomic<std::uint32_t> answered_{0};
  RigReading reading_;
  std::atomic<RigFault> write_fault_{RigFault::none};

  // The thread's own.
  std::uint32_t read_served_ = 0, write_served_ = 0;
  bool stop_served_ = false;
  bool enabled_ = false;
  bool restarted_ = false;
  bool verified_ = false;
  int boot_count_ = 0;
  int other_boots_in_a_row_ = 0, other_watchdogs_in_a_row_ = 0;
  int checks_refused_in_a_row_ = 0, reads_refused_in_a_row_ = 0, writes_refused_in_a_row_ = 0;
  std::uint64_t sequence_ = 0;
  std::uint32_t recoveries_ = 0;
  std::int64_t pause_ns_ = 0;
  std::int64_t next_attempt_ns_ = 0;
};

}  // namespace upright
