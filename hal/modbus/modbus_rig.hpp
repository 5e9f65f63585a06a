// A rig behind a Modbus link. A thread of its own talks to the device; the loop hands it requests and takes
// answers through atomics and a futex, so that a slow device can make a reading late but never the loop.
//
// What goes out when: read() is one exchange, and write() starts another that carries the voltage just
// computed, at once. So a row's voltage acts right after its reading, as the interface says, and not one
// period later, which is what a single exchange per period would mean. With function 0x17 both exchanges
// carry both directions: that of read() repeats the voltage that is already on, which also keeps the device's
// watchdog fed when a write was lost. A voltage is meant for one period: one that has been on for longer than
// `freshness_periods` is not sent any more, the exchange of read() then carries zero volts until a fresh one
// is there.
//
// With `device_clock` the device samples on its own time. The thread then asks for the next sample by itself:
// the request carries the voltage of the sample before, and the device answers it when it samples. So a
// period is one exchange, and a voltage is out as soon as it was computed.
//
// In a joined rig the device has a part of this only. As encoders it is never sent a voltage but zero, and
// with separate exchanges none at all; as output its readings have no counts and show that it answers.
#pragma once

#include <atomic>
#include <thread>

#include "../rig_lock.hpp"
#include "../sample_ring.hpp"
#include "link.hpp"
#include "stop_sequence.hpp"
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
  /// The thread tries from now on (stop_sequence.hpp) until it is done, or until the rig is destroyed.
  StopReport stop() noexcept override;
  bool is_clock() const noexcept override { return rig_.modbus->sampling.has_value(); }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override;
  int last_exception() const noexcept override { return exception_.load(std::memory_order_relaxed); }
  /// A status register shows an emergency stop and a limit switch at either end.
  SafetyInputs safety_inputs() const noexcept override {
    return rig_.modbus->status_address ? SafetyInputs{true, 2} : SafetyInputs{};
  }

 private:
  void end_thread() noexcept;
  void serve() noexcept;
  void serve_read(std::uint32_t number) noexcept;
  void serve_write() noexcept;
  void serve_sample() noexcept;
  RigFault take_sample(RingSample& sample) noexcept;
  bool sample_is_due() const noexcept;
  std::int64_t next_ns() const noexcept;
  RigReading newest_sample() noexcept;
  RigFault send_voltage() noexcept;
  void serve_stop() noexcept;
  bool stop_is_due() const noexcept;
  double fresh_voltage_v() const noexcept;
  bool voltage_is_fresh() const noexcept;
  bool offers_read_back();
  RigFault noted(RigFault fault) noexcept;
  RigFault ready() noexcept;
  RigFault other_device(int& in_a_row) noexcept;
  static RigFault certain(RigFault fault, int& refusals_in_a_row) noexcept;
  RigFault verify() noexcept;
  RigFault same_device(const DeviceReading& reading) noexcept;
  void ring() noexcept;
  [[noreturn]] void fail(RigFault fault, const std::string& doing);
  template <class Exchange>
  void retried(Exchange exchange, const std::string& doing);
  void require_line() const;
  void prepare_device();
  void require_register(int address, int counts, const std::string& doing);
  void begin_serving();

  RigFile rig_;
  RigRoles roles_;
  bool writes_;  // a voltage, be it always zero
  RigLock lock_;
  const double period_s_;
  std::int64_t patience_ns_;  // how long read() waits at most
  std::int64_t freshness_ns_;
  ModbusLink link_;
  StopSequence stop_sequence_;  // the thread's
  std::thread thread_;

  // From the loop to the thread.
  std::atomic<std::uint32_t> doorbell_{0};
  std::atomic<std::uint32_t> read_wanted_{0};
  std::atomic<std::uint32_t> write_wanted_{0};
  std::atomic<double> voltage_v_{0.0};
  std::atomic<std::int64_t> commanded_ns_{0};  // set after `voltage_v_`: too old rather than too new
  std::atomic<bool> stopping_{false};
  std::atomic<bool> ending_{false};
  // From the thread to the loop. `reading_` is written before `answered_` is, and only for a request not yet
  // answered.
  std::atomic<std::uint32_t> answered_{0};
  RigReading reading_;
  std::atomic<RigFault> write_fault_{RigFault::none};
  std::atomic<int> exception_{0};
  std::atomic<std::uint32_t> recoveries_{0};
  SampleRing samples_;  // trouble: the fault
  // What is known of the stop; `zero_confirmed_` is set last.
  std::atomic<bool> zero_confirmed_{false}, read_back_{false}, disabled_{false};
  std::atomic<RigFault> stop_fault_{RigFault::none};
  std::atomic<int> stop_exception_{0};

  // The loop's own.
  SampleReader sample_reader_;

  // The thread's own.
  std::uint32_t read_served_ = 0, write_served_ = 0;
  std::int64_t stop_begun_ns_ = 0;
  bool enabled_ = false;
  bool restarted_ = false;
  bool verified_ = false;
  bool reads_back_ = false;
  int boot_count_ = 0;
  int other_boots_in_a_row_ = 0, other_watchdogs_in_a_row_ = 0;
  int checks_refused_in_a_row_ = 0, reads_refused_in_a_row_ = 0, writes_refused_in_a_row_ = 0;
  std::uint64_t sequence_ = 0;
  std::int64_t next_sample_ns_ = 0;  // when it is asked for at the latest
  std::int64_t pause_ns_ = 0;
  std::int64_t next_attempt_ns_ = 0;
};

}  // namespace upright
