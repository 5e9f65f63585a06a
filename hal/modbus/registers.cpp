#include "registers.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace upright {

namespace {

constexpr unsigned bits_per_register = 16;

std::uint32_t joined(std::uint16_t first, std::uint16_t second, WordOrder order) noexcept {
  const std::uint32_t high = order == WordOrder::high_first ? first : second;
  const std::uint32_t low = order == WordOrder::high_first ? second : first;
  return high << bits_per_register | low;
}

std::array<std::uint16_t, 2> split(std::uint32_t word, WordOrder order) noexcept {
  const auto high = static_cast<std::uint16_t>(word >> bits_per_register);
  const auto low = static_cast<std::uint16_t>(word);
  return order == WordOrder::high_first ? std::array{high, low} : std::array{low, high};
}

template <class Integer>
Integer rounded(double value) noexcept {
  using Limits = std::numeric_limits<Integer>;
  return static_cast<Integer>(std::nearbyint(
      std::clamp(value, static_cast<double>(Limits::min()), static_cast<double>(Limits::max()))));
}

}  // namespace

double VoltageFormat::largest_v() const noexcept {
  switch (encoding) {
    case VoltageEncoding::int16:
      return std::numeric_limits<std::int16_t>::max() / counts_per_v;
    case VoltageEncoding::int32:
      return std::numeric_limits<std::int32_t>::max() / counts_per_v;
    case VoltageEncoding::float32:
      break;
  }
  return static_cast<double>(std::numeric_limits<float>::max()) / counts_per_v;
}

std::int64_t decode_counter(std::span<const std::uint16_t> registers, const CounterFormat& format) noexcept {
  return format.registers == 1 ? registers[0] : joined(registers[0], registers[1], format.word_order);
}

void encode_counter(std::int64_t counts, const CounterFormat& format,
                    std::span<std::uint16_t> registers) noexcept {
  if (format.registers == 1) {
    registers[0] = static_cast<std::uint16_t>(counts);
    return;
  }
  const auto words = split(static_cast<std::uint32_t>(counts), format.word_order);
  registers[0] = words[0];
  registers[1] = words[1];
}

std::array<std::uint16_t, 2> encode_voltage(double voltage_v, const VoltageFormat& format) noexcept {
  const double scaled = std::isfinite(voltage_v) ? voltage_v * format.counts_per_v : 0.0;
  switch (format.encoding) {
    case VoltageEncoding::int16:
      return {static_cast<std::uint16_t>(rounded<std::int16_t>(scaled)), 0};
    case VoltageEncoding::int32:
      return split(static_cast<std::uint32_t>(rounded<std::int32_t>(scaled)), format.word_order);
    case VoltageEncoding::float32:
      break;
  }
  constexpr double largest = std::numeric_limits<float>::max();
  return split(std::bit_cast<std::uint32_t>(static_cast<float>(std::clamp(scaled, -largest, largest))),
               format.word_order);
}

double decode_voltage(std::span<const std::uint16_t> registers, const VoltageFormat& format) noexcept {
  switch (format.encoding) {
    case VoltageEncoding::int16:
      return static_cast<std::int16_t>(registers[0]) / format.counts_per_v;
    case VoltageEncoding::int32:
      return static_cast<std::int32_t>(joined(registers[0], registers[1], format.word_order)) /
             format.counts_per_v;
    case VoltageEncoding::float32:
      break;
  }
  return static_cast<double>(std::bit_cast<float>(joined(registers[0], registers[1], format.word_order))) /
         format.counts_per_v;
}

RigFault fault_in_status(std::uint16_t status) noexcept {
  // Counts that are wrong matter most, and somebody's hand more than a switch.
  if ((status & 8u) != 0) return RigFault::edges_lost;
  if ((status & 1u) != 0) return RigFault::emergency_stop;
  if ((status & 2u) != 0) return RigFault::limit_switch_plus;
  if ((status & 4u) != 0) return RigFault::limit_switch_minus;
  return RigFault::none;
}

}  // namespace upright
