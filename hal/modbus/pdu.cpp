#include "pdu.hpp"

#include <algorithm>

#include "hal/modbus_exception.hpp"

namespace upright {

namespace {

constexpr std::uint8_t exception_bit = 0x80;

Pdu begun(ModbusFunction function) noexcept {
  Pdu pdu;
  pdu.add(static_cast<std::uint8_t>(function));
  return pdu;
}

void add_range(Pdu& pdu, const RegisterRange& range) noexcept {
  pdu.add_word(static_cast<std::uint16_t>(range.first));
  pdu.add_word(static_cast<std::uint16_t>(range.count));
}

void add_block(Pdu& pdu, int first, std::span<const std::uint16_t> words) noexcept {
  add_range(pdu, {first, static_cast<int>(words.size())});
  pdu.add(static_cast<std::uint8_t>(2 * words.size()));
  for (const std::uint16_t word : words) pdu.add_word(word);
}

/// How many registers a reply to `request` holds; 0: it repeats part of the request instead.
std::size_t registers_asked(const Pdu& request) noexcept {
  switch (static_cast<ModbusFunction>(request.bytes[0])) {
    case ModbusFunction::read_holding:
    case ModbusFunction::read_input:
    case ModbusFunction::read_write:
      return 256u * request.bytes[3] + request.bytes[4];
    case ModbusFunction::write_single:
    case ModbusFunction::write_multiple:
      break;
  }
  return 0;
}

}  // namespace

Pdu read_request(ModbusFunction function, const RegisterRange& range) noexcept {
  Pdu pdu = begun(function);
  add_range(pdu, range);
  return pdu;
}

Pdu write_single_request(int address, std::uint16_t word) noexcept {
  Pdu pdu = begun(ModbusFunction::write_single);
  pdu.add_word(static_cast<std::uint16_t>(address));
  pdu.add_word(word);
  return pdu;
}

Pdu write_multiple_request(int first, std::span<const std::uint16_t> words) noexcept {
  Pdu pdu = begun(ModbusFunction::write_multiple);
  add_block(pdu, first, words);
  return pdu;
}

Pdu read_write_request(const RegisterRange& read, int write_first,
                       std::span<const std::uint16_t> words) noexcept {
  Pdu pdu = begun(ModbusFunction::read_write);
  add_range(pdu, read);
  add_block(pdu, write_first, words);
  return pdu;
}

RigFault check_reply(const Pdu& request, const Pdu& reply, int& exception) noexcept {
  constexpr std::size_t exception_size = 2, echo_size = 5;
  const std::uint8_t function = request.bytes[0];
  if (reply.size == exception_size && reply.bytes[0] == (function | exception_bit)) {
    exception = reply.bytes[1];
    return passes_by_itself(exception) ? RigFault::device_busy : RigFault::device_refused;
  }
  if (reply.size < exception_size || reply.bytes[0] != function) return RigFault::corrupt_reply;
  const std::size_t bytes = 2 * registers_asked(request);
  if (bytes > 0)
    return reply.bytes[1] == bytes && reply.size == 2 + bytes ? RigFault::none : RigFault::corrupt_reply;
  const bool repeats = reply.size == echo_size &&
                       std::equal(request.bytes.begin(), request.bytes.begin() + 5, reply.bytes.begin());
  return repeats ? RigFault::none : RigFault::corrupt_reply;
}

void take_registers(const Pdu& reply, std::span<std::uint16_t> registers) noexcept {
  for (std::size_t i = 0; i < registers.size(); ++i)
    registers[i] = static_cast<std::uint16_t>(256u * reply.bytes[2 + 2 * i] + reply.bytes[3 + 2 * i]);
}

}  // namespace upright
