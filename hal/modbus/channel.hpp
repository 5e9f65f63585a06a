// What carries a Modbus request to the device and its reply back: frames over TCP or over a serial line.
#pragma once

#include <memory>
#include <string>

#include "pdu.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

class ModbusChannel {
 public:
  virtual ~ModbusChannel() = default;
  /// One attempt, at most `patience_s` long.
  virtual bool connect(double patience_s) noexcept = 0;
  virtual void close() noexcept = 0;
  /// Closes so that what was sent and has not arrived never does.
  virtual void abandon() noexcept = 0;
  /// Throws away what has come unasked.
  virtual void flush() noexcept = 0;
  /// Waits until nothing has come for `quiet_s`, and throws away what did; at most four times as long.
  virtual void await_silence(double quiet_s) noexcept = 0;
  /// Sends a request and takes its reply, within `patience_s`. The frame of a reply is checked: its check sum
  /// or its header, its length, and the unit that it comes from. What is in it is not.
  virtual RigFault exchange(const Pdu& request, Pdu& reply, double patience_s) noexcept = 0;
};

/// `address` is a number, not a name. Throws DeviceError when out of memory.
std::unique_ptr<ModbusChannel> make_tcp_channel(const ModbusRig& rig, const std::string& address);
std::unique_ptr<ModbusChannel> make_serial_channel(const ModbusRig& rig);

}  // namespace upright
