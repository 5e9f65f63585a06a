// Modbus requests and replies without their frames: function code and data. Pure functions, no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "upright/hal/rig.hpp"

namespace upright {

enum class ModbusFunction : std::uint8_t {
  read_holding = 0x03,
  read_input = 0x04,
  write_single = 0x06,
  write_multiple = 0x10,
  read_write = 0x17,
};

/// Function code and data.
struct Pdu {
  static constexpr std::size_t longest = 253;

  std::array<std::uint8_t, longest> bytes{};
  std::size_t size = 0;

  void add(std::uint8_t byte) noexcept { bytes[size++] = byte; }
  void add_word(std::uint16_t word) noexcept {
    add(static_cast<std::uint8_t>(word >> 8));
    add(static_cast<std::uint8_t>(word));
  }
};

/// Registers that lie one after the other: at most 125 in a request.
struct RegisterRange {
  int first = 0;
  int count = 0;
};

/// `function` is one of the two that only read.
Pdu read_request(ModbusFunction function, const RegisterRange& range) noexcept;
Pdu write_single_request(int address, std::uint16_t word) noexcept;
Pdu write_multiple_request(int first, std::span<const std::uint16_t> words) noexcept;
/// Function 0x17: writes first, then reads.
Pdu read_write_request(const RegisterRange& read, int write_first,
                       std::span<const std::uint16_t> words) noexcept;

/// What a reply is worth as the answer to `request`: its function, its size, and of a write the address and
/// the quantity (or the value) that it repeats. An exception gives `exception` its number and is
/// RigFault::device_busy or RigFault::device_refused; anything else that does not fit is
/// RigFault::corrupt_reply.
RigFault check_reply(const Pdu& request, const Pdu& reply, int& exception) noexcept;

/// The registers in a reply to a read that was checked.
void take_registers(const Pdu& reply, std::span<std::uint16_t> registers) noexcept;

}  // namespace upright
