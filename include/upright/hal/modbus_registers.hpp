// How counts and volts are laid out in 16-bit Modbus registers. Pure functions, no allocation.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "upright/hal/rig.hpp"

namespace upright {

enum class WordOrder : std::uint8_t { high_first, low_first };
enum class VoltageEncoding : std::uint8_t { int16, int32, float32 };

/// A counter: one register (16 bits) or two (32 bits).
struct CounterFormat {
  int registers = 2;
  WordOrder word_order = WordOrder::high_first;
};

/// The voltage: int16 (one register), int32 or float32 (two). Integers hold volts times `counts_per_v`.
struct VoltageFormat {
  VoltageEncoding encoding = VoltageEncoding::int16;
  WordOrder word_order = WordOrder::high_first;
  double counts_per_v = 1.0;

  int registers() const noexcept { return encoding == VoltageEncoding::int16 ? 1 : 2; }
  /// The largest voltage that fits.
  double largest_v() const noexcept;
};

/// Counts from registers, as the unsigned number they hold.
std::int64_t decode_counter(std::span<const std::uint16_t> registers, const CounterFormat& format) noexcept;
void encode_counter(std::int64_t counts, const CounterFormat& format,
                    std::span<std::uint16_t> registers) noexcept;

/// Volts that do not fit are clamped to what does; a value that is not finite becomes zero.
std::array<std::uint16_t, 2> encode_voltage(double voltage_v, const VoltageFormat& format) noexcept;
/// May be not finite with float32: the registers hold whatever the other side wrote.
double decode_voltage(std::span<const std::uint16_t> registers, const VoltageFormat& format) noexcept;

/// What a device's status register says has stopped the motor. Bit 0: the emergency stop; 1 and 2: the limit
/// switches at the +x and the -x end; 3: edges of an encoder were lost.
RigFault fault_in_status(std::uint16_t status) noexcept;

}  // namespace upright
