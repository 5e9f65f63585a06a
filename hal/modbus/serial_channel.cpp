// Modbus RTU frames, by libmodbus: line settings, check sum, and where a frame ends.
#include <linux/serial.h>
#include <modbus.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "channel.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

constexpr std::size_t unit_size = 1, check_sum_size = 2;

RigFault fault_of_serial_errno(int error) noexcept {
  if (error == ETIMEDOUT) return RigFault::link_timeout;
  return error == EMBBADCRC || error == EMBBADDATA ? RigFault::corrupt_reply : RigFault::link_lost;
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

class SerialChannel final : public ModbusChannel {
 public:
  explicit SerialChannel(const ModbusRig& rig) : unit_(static_cast<std::uint8_t>(rig.unit)) {
    const char parity = rig.parity == Parity::none ? 'N' : rig.parity == Parity::even ? 'E' : 'O';
    context_.reset(modbus_new_rtu(rig.device.c_str(), rig.baud, parity, 8, rig.stop_bits));
    if (!context_) throw DeviceError(std::string(modbus_strerror(errno)) + ": check the link's settings");
    modbus_set_slave(context_.get(), rig.unit);
    modbus_set_error_recovery(context_.get(), MODBUS_ERROR_RECOVERY_NONE);
    modbus_set_byte_timeout(context_.get(), 0, 0);
  }
  ~SerialChannel() override { close(); }
  SerialChannel(const SerialChannel&) = delete;
  SerialChannel& operator=(const SerialChannel&) = delete;

  bool connect(double) noexcept override {
    close();
    if (modbus_connect(context_.get()) != 0) return false;
    open_ = true;
    ask_for_low_latency(modbus_get_socket(context_.get()));
    flush();
    return true;
  }

  void close() noexcept override {
    if (open_) modbus_close(context_.get());
    open_ = false;
  }

  void abandon() noexcept override { close(); }

  void flush() noexcept override { modbus_flush(context_.get()); }

  void await_silence(double quiet_s) noexcept override {
    constexpr int max_rounds = 4;
    const int quiet_ms = std::max(1, static_cast<int>(quiet_s * 1e3));
    for (int i = 0; i < max_rounds; ++i) {
      pollfd line{modbus_get_socket(context_.get()), POLLIN, 0};
      if (poll(&line, 1, quiet_ms) <= 0) return;
      flush();
    }
  }

  RigFault exchange(const Pdu& request, Pdu& reply, double patience_s) noexcept override {
    std::array<std::uint8_t, unit_size + Pdu::longest> addressed;
    addressed[0] = unit_;
    std::copy_n(request.bytes.begin(), request.size, addressed.begin() + unit_size);
    set_timeout(context_.get(), patience_s);
    const int size = static_cast<int>(unit_size + request.size);
    if (modbus_send_raw_request(context_.get(), addressed.data(), size) < 0)
      return fault_of_serial_errno(errno);
    std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> frame;
    const int got = modbus_receive_confirmation(context_.get(), frame.data());
    if (got < 0) return fault_of_serial_errno(errno);
    // Of another unit libmodbus says nothing but that it has no length.
    const auto length = static_cast<std::size_t>(got);
    if (length < unit_size + 2 + check_sum_size || frame[0] != unit_) return RigFault::corrupt_reply;
    reply.size = length - unit_size - check_sum_size;
    std::copy_n(frame.begin() + unit_size, reply.size, reply.bytes.begin());
    return RigFault::none;
  }

 private:
  struct Free {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };

  std::unique_ptr<modbus_t, Free> context_;
  std::uint8_t unit_;
  bool open_ = false;
};

}  // namespace

std::unique_ptr<ModbusChannel> make_serial_channel(const ModbusRig& rig) {
  return std::make_unique<SerialChannel>(rig);
}

}  // namespace upright
