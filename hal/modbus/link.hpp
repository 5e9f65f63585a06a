// One Modbus link as hardware needs it: short time-outs, a flush before every request, and never a reply that
// belongs to an earlier request.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "channel.hpp"
#include "pdu.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// What one reading of the device holds.
struct DeviceReading {
  std::int64_t cart_counts = 0;
  std::int64_t pendulum_counts = 0;
  int boot_count = 0;
  RigFault stopped_by = RigFault::none;  ///< by its status: why the device itself has stopped the motor
};

class ModbusLink {
 public:
  /// Throws DeviceError when the host has no address, or out of memory.
  explicit ModbusLink(const RigFile& rig);

  /// What the device is reached by, the same for everybody who means it: "ADDRESS:PORT", or the line's file.
  const std::string& name() const noexcept { return name_; }
  /// One attempt, at most `patience_s` long.
  RigFault connect(double patience_s) noexcept;
  void close() noexcept;
  bool connected() const noexcept { return connected_; }
  bool serial() const noexcept { return serial_; }
  /// How long a reply is waited for from now on; the rig file's time at first.
  void wait_for_replies(double patience_s) noexcept { patience_s_ = patience_s; }
  /// Where nothing in a reply names its request: lets late ones come, and throws them away. Another way to
  /// get back in step, for a device that refuses what `resynchronise` asks.
  void await_silence(double quiet_s) noexcept;

  /// Reads the counters. With function 0x17 `held_v` goes out in the same exchange. Where only the output is
  /// Modbus there are no counters: the exchange then shows that the device answers, and repeats the voltage.
  RigFault read(double held_v, DeviceReading& reading) noexcept;
  /// The next sample of a device that samples every `period_s`, and `held_v` goes out at once in the same
  /// exchange.
  RigFault read_next(double held_v, double period_s, DeviceReading& reading) noexcept;
  /// Where another backend has the output, zero goes out, whatever is asked for.
  RigFault write_voltage(double voltage_v) noexcept;
  /// Zero volts by one function, 0x17, 0x10 or 0x06.
  RigFault write_zero(ModbusFunction function) noexcept;
  /// What the voltage's registers hold.
  RigFault read_voltage(double& voltage_v) noexcept;
  /// With function 0x10, or 0x06 for a device that does not know it.
  RigFault write_register(int address, int value) noexcept;
  RigFault read_register(int address, int& value) noexcept;
  /// Brings question and answer back in step after an error on a serial line, where nothing in a reply names
  /// its request: asks for fewer registers than usual until an answer of that shape comes.
  RigFault resynchronise(double held_v) noexcept;
  bool in_step() const noexcept { return in_step_; }

  /// Of the latest reply that was one; 0: there was none.
  int last_exception() const noexcept { return exception_; }
  /// When a request was last left without an answer, on the monotonic clock: the device may still act on it.
  std::int64_t last_unanswered_ns() const noexcept { return unanswered_ns_; }

 private:
  static constexpr int max_registers = 125;

  void find_block() noexcept;
  std::array<std::uint16_t, 2> voltage_words(double voltage_v) const noexcept;
  RigFault ask(const Pdu& request, double waits_s = 0.0) noexcept;
  RigFault read_registers(const Pdu& request, int count, double waits_s = 0.0) noexcept;
  RigFault read_block(int registers, double held_v, double waits_s = 0.0) noexcept;
  DeviceReading reading_in_block() const noexcept;
  RigFault named(RigFault fault) noexcept;

  ModbusRig config_;
  int amplifier_sign_;
  bool serial_;
  RigRoles roles_;
  std::string address_;  // of a TCP device, as a number
  std::string name_;
  double patience_s_;
  bool connected_ = false;
  bool in_step_ = false;
  bool knows_write_multiple_ = true;
  int exception_ = 0;
  std::int64_t unanswered_ns_ = 0;
  int first_ = 0;
  int block_ = 0;         // registers that read() asks for; 0: there is nothing to read
  int sample_block_ = 0;  // the same with the number of a sample
  int other_block_ = 0;   // asked for to tell an answer from those to earlier requests
  std::unique_ptr<ModbusChannel> channel_;
  Pdu reply_;
  std::array<std::uint16_t, max_registers> registers_{};
};

}  // namespace upright
