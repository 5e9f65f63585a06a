#include "link.hpp"

#include <netdb.h>
#include <sys/socket.h>
#include <time.h>

#include <algorithm>
#include <filesystem>
#include <span>

#include "registers.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

constexpr int illegal_function = 1, device_failure = 4;

/// The IPv4 address of a host.
std::string address_of(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int problem = getaddrinfo(host.c_str(), nullptr, &hints, &found); problem != 0)
    throw DeviceError(host + " has no IP address (" + gai_strerror(problem) + "): check modbus.host");
  char text[NI_MAXHOST] = "";
  getnameinfo(found->ai_addr, found->ai_addrlen, text, sizeof text, nullptr, 0, NI_NUMERICHOST);
  freeaddrinfo(found);
  return text;
}

std::string name_of(const ModbusRig& rig, const std::string& address) {
  if (!address.empty()) return address + ":" + std::to_string(rig.port);
  std::error_code unresolved;
  const std::filesystem::path line = std::filesystem::canonical(rig.device, unresolved);
  return unresolved ? rig.device : line.string();
}

bool is_answer(RigFault fault) noexcept {
  return fault == RigFault::none || fault == RigFault::device_refused || fault == RigFault::device_busy;
}

}  // namespace

ModbusLink::ModbusLink(const RigFile& rig)
    : config_(*rig.modbus),
      amplifier_sign_(rig.amplifier.sign),
      serial_(roles_of(rig, Backend::modbus_rtu).any()),
      roles_(roles_of(rig, serial_ ? Backend::modbus_rtu : Backend::modbus_tcp)),
      address_(serial_ ? std::string() : address_of(config_.host)),
      name_(name_of(config_, address_)),
      patience_s_(config_.response_timeout_s),
      channel_(serial_ ? make_serial_channel(config_) : make_tcp_channel(config_, address_)) {
  find_block();
}

void ModbusLink::find_block() noexcept {
  int end = 0;
  const auto include = [&](int address, int registers) {
    first_ = end == 0 ? address : std::min(first_, address);
    end = std::max(end, address + registers);
  };
  if (roles_.cart) include(config_.cart_address, config_.counter.registers);
  if (roles_.pendulum) include(config_.pendulum_address, config_.counter.registers);
  if (config_.boot_count_address) include(*config_.boot_count_address, 1);
  if (config_.status_address) include(*config_.status_address, 1);
  // Function 0x17 has to read something: without counters it is the voltage it has just written.
  if (end == 0 && config_.exchange == ModbusExchange::read_write)
    include(config_.voltage_address, config_.voltage.registers());
  block_ = end - first_;
  if (config_.sampling) sample_block_ = std::max(block_, config_.sampling->sample_address + 1 - first_);
  const int counter = config_.counter.registers;
  other_block_ = block_ > counter ? counter : block_ > 1 ? 1 : 2;
}

std::array<std::uint16_t, 2> ModbusLink::voltage_words(double voltage_v) const noexcept {
  // Not minus zero, which some device may take for a number like another.
  const double at_device_v = roles_.output && voltage_v != 0.0 ? amplifier_sign_ * voltage_v : 0.0;
  return encode_voltage(at_device_v, config_.voltage);
}

RigFault ModbusLink::connect(double patience_s) noexcept {
  close();
  if (!channel_->connect(patience_s)) return RigFault::link_lost;
  connected_ = true;
  in_step_ = !serial_;  // whatever a serial line still carries is not for us
  return RigFault::none;
}

void ModbusLink::close() noexcept {
  if (connected_) channel_->close();
  connected_ = false;
}

void ModbusLink::await_silence(double quiet_s) noexcept {
  if (!connected_) return;
  channel_->await_silence(quiet_s);
  in_step_ = true;
}

/// One exchange, with its reply in `reply_`, for which the device waits so long. After a request without an
/// answer the peer may still answer: TCP closes, so that the answer goes nowhere; a serial line
/// resynchronises.
RigFault ModbusLink::ask(const Pdu& request, double waits_s) noexcept {
  if (!connected_) return RigFault::link_lost;
  const std::int64_t asked_ns = monotonic_ns();
  channel_->flush();
  // A process that stood still in here does not send what it carries: a voltage that has become old.
  if (static_cast<double>(monotonic_ns() - asked_ns) > 1e9 * patience_s_) return RigFault::link_timeout;
  RigFault fault = channel_->exchange(request, reply_, patience_s_ + waits_s);
  if (fault == RigFault::none) fault = check_reply(request, reply_, exception_);
  if (is_answer(fault)) return fault;
  unanswered_ns_ = monotonic_ns();
  in_step_ = false;
  if (!serial_ || fault == RigFault::link_lost) {
    channel_->abandon();
    connected_ = false;
  }
  return fault;
}

/// The first `count` of `registers_`.
RigFault ModbusLink::read_registers(const Pdu& request, int count, double waits_s) noexcept {
  const RigFault fault = ask(request, waits_s);
  if (fault == RigFault::none)
    take_registers(reply_, std::span(registers_).first(static_cast<std::size_t>(count)));
  return fault;
}

RigFault ModbusLink::read_block(int registers, double held_v, double waits_s) noexcept {
  const RegisterRange range{first_, registers};
  if (config_.exchange == ModbusExchange::separate)
    return read_registers(
        read_request(config_.input_registers ? ModbusFunction::read_input : ModbusFunction::read_holding,
                     range),
        registers);
  const auto words = voltage_words(held_v);
  const auto used = std::span(words).first(static_cast<std::size_t>(config_.voltage.registers()));
  return read_registers(read_write_request(range, config_.voltage_address, used), registers, waits_s);
}

/// A device that has no counts to give says why in its status, where it has one.
RigFault ModbusLink::named(RigFault fault) noexcept {
  if (fault != RigFault::device_refused || exception_ != device_failure || !config_.status_address)
    return fault;
  const auto function = config_.input_registers ? ModbusFunction::read_input : ModbusFunction::read_holding;
  if (read_registers(read_request(function, {*config_.status_address, 1}), 1) != RigFault::none) return fault;
  const RigFault cause = fault_in_status(registers_[0]);
  return cause == RigFault::none ? fault : cause;
}

RigFault ModbusLink::read(double held_v, DeviceReading& reading) noexcept {
  if (block_ == 0) return write_voltage(held_v);
  if (const RigFault fault = read_block(block_, held_v); fault != RigFault::none) return named(fault);
  reading = reading_in_block();
  return RigFault::none;
}

RigFault ModbusLink::read_next(double held_v, double period_s, DeviceReading& reading) noexcept {
  const RigFault fault = read_block(sample_block_, held_v, period_s);
  if (fault != RigFault::none) return named(fault);
  reading = reading_in_block();
  return RigFault::none;
}

DeviceReading ModbusLink::reading_in_block() const noexcept {
  const auto at = [&](int address) {
    return std::span<const std::uint16_t>(registers_).subspan(static_cast<std::size_t>(address - first_), 2);
  };
  DeviceReading reading;
  if (roles_.cart) reading.cart_counts = decode_counter(at(config_.cart_address), config_.counter);
  if (roles_.pendulum)
    reading.pendulum_counts = decode_counter(at(config_.pendulum_address), config_.counter);
  if (config_.boot_count_address) reading.boot_count = at(*config_.boot_count_address)[0];
  if (config_.status_address) reading.stopped_by = fault_in_status(at(*config_.status_address)[0]);
  return reading;
}

RigFault ModbusLink::write_voltage(double voltage_v) noexcept {
  if (config_.exchange == ModbusExchange::read_write) return named(read_block(block_, voltage_v));
  const auto words = voltage_words(voltage_v);
  const auto used = std::span(words).first(static_cast<std::size_t>(config_.voltage.registers()));
  return ask(write_multiple_request(config_.voltage_address, used));
}

RigFault ModbusLink::write_zero(ModbusFunction function) noexcept {
  constexpr std::array<std::uint16_t, 2> zero{};
  const int count = config_.voltage.registers();
  if (function == ModbusFunction::read_write) return read_block(block_, 0.0);
  if (function == ModbusFunction::write_multiple)
    return ask(write_multiple_request(config_.voltage_address,
                                      std::span(zero).first(static_cast<std::size_t>(count))));
  RigFault fault = RigFault::none;
  for (int i = 0; i < count && fault == RigFault::none; ++i)
    fault = ask(write_single_request(config_.voltage_address + i, 0));
  return fault;
}

RigFault ModbusLink::read_voltage(double& voltage_v) noexcept {
  const int count = config_.voltage.registers();
  const RigFault fault =
      read_registers(read_request(ModbusFunction::read_holding, {config_.voltage_address, count}), count);
  if (fault == RigFault::none) voltage_v = amplifier_sign_ * decode_voltage(registers_, config_.voltage);
  return fault;
}

RigFault ModbusLink::write_register(int address, int value) noexcept {
  const auto word = static_cast<std::uint16_t>(value);
  if (knows_write_multiple_) {
    const RigFault fault = ask(write_multiple_request(address, std::span(&word, 1)));
    if (fault != RigFault::device_refused || exception_ != illegal_function) return fault;
  }
  const RigFault fault = ask(write_single_request(address, word));
  if (fault == RigFault::none) knows_write_multiple_ = false;
  return fault;
}

RigFault ModbusLink::read_register(int address, int& value) noexcept {
  const RigFault fault = read_registers(read_request(ModbusFunction::read_holding, {address, 1}), 1);
  if (fault == RigFault::none) value = registers_[0];
  return fault;
}

RigFault ModbusLink::resynchronise(double held_v) noexcept {
  int value = 0;
  const RigFault fault =
      block_ == 0 ? read_register(config_.voltage_address, value) : named(read_block(other_block_, held_v));
  if (fault == RigFault::none) in_step_ = true;
  return fault;
}

}  // namespace upright
