#include "link.hpp"

#include <linux/serial.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <span>

#include "upright/model/error.hpp"

namespace upright {

namespace {

/// The IPv4 address of a host: libmodbus's TCP context takes numbers only.
std::string address_of(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int problem = getaddrinfo(host.c_str(), nullptr, &hints, &found); problem != 0)
    throw DeviceError("check modbus.host: " + host + " has no address (" + gai_strerror(problem) + ")");
  char text[NI_MAXHOST] = "";
  getnameinfo(found->ai_addr, found->ai_addrlen, text, sizeof text, nullptr, 0, NI_NUMERICHOST);
  freeaddrinfo(found);
  return text;
}

modbus_t* new_context(const ModbusRig& rig, const std::string& address) {
  if (!address.empty()) return modbus_new_tcp(address.c_str(), rig.port);
  const char parity = rig.parity == Parity::none ? 'N' : rig.parity == Parity::even ? 'E' : 'O';
  return modbus_new_rtu(rig.device.c_str(), rig.baud, parity, 8, rig.stop_bits);
}

std::string name_of(const ModbusRig& rig, const std::string& address) {
  if (!address.empty()) return address + ":" + std::to_string(rig.port);
  std::error_code unresolved;
  const std::filesystem::path line = std::filesystem::canonical(rig.device, unresolved);
  return unresolved ? rig.device : line.string();
}

RigFault fault_of_errno(int error) noexcept {
  if (error == ETIMEDOUT) return RigFault::link_timeout;
  if (error == EMBBADCRC || error == EMBBADDATA || error == EMBBADEXC || error == EMBMDATA ||
      error == EMBBADSLAVE || error == EMBUNKEXC)
    return RigFault::corrupt_reply;
  if (error >= EMBXILFUN && error < EMBBADCRC) return RigFault::device_refused;
  return RigFault::link_lost;
}

void set_timeout(modbus_t* context, double seconds) noexcept {
  const auto us = static_cast<std::uint32_t>(std::max(1.0, seconds * 1e6));
  modbus_set_response_timeout(context, us / 1'000'000, us % 1'000'000);
}

/// USB serial adapters otherwise hold bytes back for up to 16 ms. Not every driver knows the request.
void ask_for_low_latency(int descriptor) noexcept {
  serial_struct settings{};
  if (ioctl(descriptor, TIOCGSERIAL, &settings) != 0) return;
  settings.flags |= ASYNC_LOW_LATENCY;
  ioctl(descriptor, TIOCSSERIAL, &settings);
}

}  // namespace

ModbusLink::ModbusLink(const RigFile& rig)
    : config_(*rig.modbus),
      amplifier_sign_(rig.amplifier.sign),
      serial_(roles_of(rig, Backend::modbus_rtu).any()),
      roles_(roles_of(rig, serial_ ? Backend::modbus_rtu : Backend::modbus_tcp)),
      address_(serial_ ? std::string() : address_of(config_.host)),
      name_(name_of(config_, address_)),
      context_(new_context(config_, address_)) {
  if (!context_) throw DeviceError(std::string("check the link's settings: ") + modbus_strerror(errno));
  find_block();
  modbus_set_slave(context_.get(), config_.unit);
  modbus_set_error_recovery(context_.get(), MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_byte_timeout(context_.get(), 0, 0);
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
  // Function 0x17 has to read something: without counters it is the voltage it has just written.
  if (end == 0 && config_.exchange == ModbusExchange::read_write)
    include(config_.voltage_address, config_.voltage.registers());
  block_ = end - first_;
  const int counter = config_.counter.registers;
  other_block_ = block_ > counter ? counter : block_ > 1 ? 1 : 2;
}

std::array<std::uint16_t, 2> ModbusLink::voltage_words(double voltage_v) const noexcept {
  return encode_voltage(roles_.output ? amplifier_sign_ * voltage_v : 0.0, config_.voltage);
}

RigFault ModbusLink::connect(double patience_s) noexcept {
  close();
  set_timeout(context_.get(), patience_s);
  if (modbus_connect(context_.get()) != 0) return RigFault::link_lost;
  set_timeout(context_.get(), config_.response_timeout_s);
  const int descriptor = modbus_get_socket(context_.get());
  if (serial_) {
    ask_for_low_latency(descriptor);
  } else {
    const int on = 1;
    setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  connected_ = true;
  in_step_ = !serial_;  // whatever a serial line still carries is not for us
  modbus_flush(context_.get());
  return RigFault::none;
}

void ModbusLink::close() noexcept {
  if (connected_) modbus_close(context_.get());
  connected_ = false;
}

/// The fault of an exchange that should have moved `expected` registers. After an error the peer may still
/// answer: TCP closes, so that the answer goes nowhere; a serial line resynchronises.
RigFault ModbusLink::result(int count, int expected) noexcept {
  if (count == expected) return RigFault::none;
  const RigFault fault = count < 0 ? fault_of_errno(errno) : RigFault::corrupt_reply;
  in_step_ = false;
  if (!serial_ || fault == RigFault::link_lost) close();
  return fault;
}

RigFault ModbusLink::read_block(int registers, double held_v) noexcept {
  if (!connected_) return RigFault::link_lost;
  modbus_t* context = context_.get();
  modbus_flush(context);
  if (config_.exchange == ModbusExchange::read_write) {
    const auto words = voltage_words(held_v);
    return result(
        modbus_write_and_read_registers(context, config_.voltage_address, config_.voltage.registers(),
                                        words.data(), first_, registers, registers_.data()),
        registers);
  }
  const auto read = config_.input_registers ? modbus_read_input_registers : modbus_read_registers;
  return result(read(context, first_, registers, registers_.data()), registers);
}

RigFault ModbusLink::read(double held_v, DeviceReading& reading) noexcept {
  if (block_ == 0) return write_voltage(held_v);
  if (const RigFault fault = read_block(block_, held_v); fault != RigFault::none) return fault;
  const auto at = [&](int address) {
    return std::span<const std::uint16_t>(registers_).subspan(static_cast<std::size_t>(address - first_), 2);
  };
  if (roles_.cart) reading.cart_counts = decode_counter(at(config_.cart_address), config_.counter);
  if (roles_.pendulum)
    reading.pendulum_counts = decode_counter(at(config_.pendulum_address), config_.counter);
  reading.boot_count = config_.boot_count_address ? at(*config_.boot_count_address)[0] : 0;
  return RigFault::none;
}

RigFault ModbusLink::write_voltage(double voltage_v) noexcept {
  if (config_.exchange == ModbusExchange::read_write) return read_block(block_, voltage_v);
  if (!connected_) return RigFault::link_lost;
  modbus_flush(context_.get());
  const auto words = voltage_words(voltage_v);
  const int count = config_.voltage.registers();
  return result(modbus_write_registers(context_.get(), config_.voltage_address, count, words.data()), count);
}

RigFault ModbusLink::write_register(int address, int value) noexcept {
  if (!connected_) return RigFault::link_lost;
  modbus_flush(context_.get());
  const auto word = static_cast<std::uint16_t>(value);
  return result(modbus_write_registers(context_.get(), address, 1, &word), 1);
}

RigFault ModbusLink::read_register(int address, int& value) noexcept {
  if (!connected_) return RigFault::link_lost;
  modbus_flush(context_.get());
  std::uint16_t word = 0;
  const RigFault fault = result(modbus_read_registers(context_.get(), address, 1, &word), 1);
  if (fault == RigFault::none) value = word;
  return fault;
}

RigFault ModbusLink::resynchronise(double held_v) noexcept {
  int value = 0;
  const RigFault fault =
      block_ == 0 ? read_register(config_.voltage_address, value) : read_block(other_block_, held_v);
  if (fault == RigFault::none) in_step_ = true;
  return fault;
}

}  // namespace upright
