// Encoding of counts and volts in 16-bit Modbus registers. Pure functions, no allocation.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "upright/hal/rig.hpp"
#include "upright/hal/wiring.hpp"

namespace upright {

/// Counts from registers, as an unsigned number.
std::int64_t decode_counter(std::span<const std::uint16_t> registers, const CounterFormat& format) noexcept;
/// Counts as registers, the reverse of `decode_counter`.
void encode_counter(std::int64_t counts, const CounterFormat& format,
                    std::span<std::uint16_t> registers) noexcept;

/// Volts beyond the range of the format are clamped; a value that is not finite becomes zero.
std::array<std::uint16_t, 2> encode_voltage(double voltage_v, const VoltageFormat& format) noexcept;
/// The result may be non-finite with float32, since the registers hold what the device wrote.
double decode_voltage(std::span<const std::uint16_t> registers, const VoltageFormat& format) noexcept;

/// The cause for which a device has stopped the motor, from its status register. Bit 0: emergency stop;
/// bits 1 and 2: limit switch at the +x and at the -x end; bit 3: encoder edges were lost.
RigFault fault_in_status(std::uint16_t status) noexcept;

}  // namespace upright
