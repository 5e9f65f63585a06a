// One Modbus link over libmodbus, as hardware needs it: short time-outs, no recovery of libmodbus's own, a
// flush before every request, and never a reply that belongs to an earlier request.
#pragma once

#include <modbus.h>

#include <array>
#include <memory>
#include <string>

#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// What one reading of the device holds.
struct DeviceReading {
  std::int64_t cart_counts = 0;
  std::int64_t pendulum_counts = 0;
  int boot_count = 0;
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

  /// Reads the counters. With function 0x17 `held_v`, the voltage already commanded, goes out in the same
  /// exchange. Where only the output is Modbus there are no counters: the exchange then shows that the device
  /// answers, and repeats the voltage.
  RigFault read(double held_v, DeviceReading& reading) noexcept;
  /// Where another backend has the output, zero goes out, whatever is asked for.
  RigFault write_voltage(double voltage_v) noexcept;
  RigFault write_register(int address, int value) noexcept;
  RigFault read_register(int address, int& value) noexcept;
  /// Brings question and answer back in step after an error on a serial line, where nothing in a reply names
  /// its request: asks for fewer registers than usual until an answer of that shape comes.
  RigFault resynchronise(double held_v) noexcept;
  bool in_step() const noexcept { return in_step_; }

 private:
  struct Free {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };
  static constexpr int most_registers = 125;

  void find_block() noexcept;
  std::array<std::uint16_t, 2> voltage_words(double voltage_v) const noexcept;
  RigFault result(int count, int expected) noexcept;
  RigFault read_block(int registers, double held_v) noexcept;

  ModbusRig config_;
  int amplifier_sign_;
  bool serial_;
  RigRoles roles_;
  std::string address_;  // of a TCP device, as a number
  std::string name_;
  bool connected_ = false;
  bool in_step_ = false;
  int first_ = 0;
  int block_ = 0;        // registers that read() asks for; 0: there is nothing to read
  int other_block_ = 0;  // asked for to tell an answer from those to earlier requests
  std::unique_ptr<modbus_t, Free> context_;
  std::array<std::uint16_t, most_registers> registers_{};
};

}  // namespace upright
