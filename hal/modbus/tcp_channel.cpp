// Modbus TCP frames. Not libmodbus's: it takes replies of any unit and of any length in the header.
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "channel.hpp"
#include "upright/hal/clock.hpp"

namespace upright {

namespace {

constexpr std::size_t header_size = 7;

std::int64_t after_ns(double seconds) noexcept {
  return monotonic_ns() + static_cast<std::int64_t>(seconds * 1e9);
}

class TcpChannel final : public ModbusChannel {
 public:
  TcpChannel(const ModbusRig& rig, const std::string& address) : unit_(static_cast<std::uint8_t>(rig.unit)) {
    address_.sin_family = AF_INET;
    address_.sin_port = htons(static_cast<std::uint16_t>(rig.port));
    inet_pton(AF_INET, address.c_str(), &address_.sin_addr);
  }
  ~TcpChannel() override { close(); }
  TcpChannel(const TcpChannel&) = delete;
  TcpChannel& operator=(const TcpChannel&) = delete;

  bool connect(double patience_s) noexcept override {
    close();
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket_ < 0) return false;
    const int on = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    const auto* to = reinterpret_cast<const sockaddr*>(&address_);
    if (::connect(socket_, to, sizeof address_) == 0) return true;
    int problem = errno;
    if (problem == EINPROGRESS && comes(POLLOUT, after_ns(patience_s))) {
      socklen_t size = sizeof problem;
      if (getsockopt(socket_, SOL_SOCKET, SO_ERROR, &problem, &size) == 0 && problem == 0) return true;
    }
    abandon();
    return false;
  }

  void close() noexcept override {
    if (socket_ < 0) return;
    ::shutdown(socket_, SHUT_RDWR);
    ::close(socket_);
    socket_ = -1;
  }

  /// With a reset: the kernel would send an old voltage again and again until the link is back.
  void abandon() noexcept override {
    if (socket_ < 0) return;
    const linger at_once{1, 0};
    setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    ::close(socket_);
    socket_ = -1;
  }

  void flush() noexcept override {
    std::array<std::uint8_t, 512> waste;
    while (::recv(socket_, waste.data(), waste.size(), MSG_DONTWAIT) > 0) {
    }
  }

  void await_silence(double) noexcept override { flush(); }  // a reply names its request

  RigFault exchange(const Pdu& request, Pdu& reply, double patience_s) noexcept override {
    const std::int64_t until_ns = after_ns(patience_s);
    ++transaction_;
    std::array<std::uint8_t, header_size + Pdu::longest> frame;
    put_header(frame, request.size);
    std::copy_n(request.bytes.begin(), request.size, frame.begin() + header_size);
    const std::size_t size = header_size + request.size;
    const ssize_t sent = ::send(socket_, frame.data(), size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent != static_cast<ssize_t>(size)) return RigFault::link_lost;
    std::array<std::uint8_t, header_size> header;
    if (const RigFault fault = take(header, header_size, until_ns); fault != RigFault::none) return fault;
    if (!fits(header, reply.size)) return RigFault::corrupt_reply;
    return take(reply.bytes, reply.size, until_ns);
  }

 private:
  /// Transaction, protocol 0, length of what follows the length, unit.
  template <class Bytes>
  void put_header(Bytes& bytes, std::size_t pdu_size) const noexcept {
    const auto length = static_cast<std::uint16_t>(pdu_size + 1);
    bytes[0] = static_cast<std::uint8_t>(transaction_ >> 8);
    bytes[1] = static_cast<std::uint8_t>(transaction_);
    bytes[2] = bytes[3] = 0;
    bytes[4] = static_cast<std::uint8_t>(length >> 8);
    bytes[5] = static_cast<std::uint8_t>(length);
    bytes[6] = unit_;
  }

  /// The header is that of a reply to the latest request, from the unit that was asked. Gives the PDU's size.
  bool fits(const std::array<std::uint8_t, header_size>& header, std::size_t& pdu_size) const noexcept {
    const std::size_t length = 256u * header[4] + header[5];
    if (length < 2 || length - 1 > Pdu::longest) return false;
    pdu_size = length - 1;
    std::array<std::uint8_t, header_size> expected;
    put_header(expected, pdu_size);
    return header == expected;
  }

  bool comes(short event, std::int64_t until_ns) const noexcept {
    pollfd watched{socket_, event, 0};
    for (;;) {
      const std::int64_t left_ns = std::max<std::int64_t>(0, until_ns - monotonic_ns());
      const timespec timeout{left_ns / nanoseconds_per_second, left_ns % nanoseconds_per_second};
      const int ready = ppoll(&watched, 1, &timeout, nullptr);
      if (ready > 0) return true;
      if (ready == 0 || errno != EINTR) return false;
    }
  }

  template <class Bytes>
  RigFault take(Bytes& bytes, std::size_t size, std::int64_t until_ns) const noexcept {
    for (std::size_t done = 0; done < size;) {
      const ssize_t got = ::recv(socket_, bytes.data() + done, size - done, MSG_DONTWAIT);
      if (got > 0) {
        done += static_cast<std::size_t>(got);
        continue;
      }
      if (got < 0 && errno == EINTR) continue;
      if (got == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return RigFault::link_lost;
      if (!comes(POLLIN, until_ns)) return RigFault::link_timeout;
    }
    return RigFault::none;
  }

  sockaddr_in address_{};
  std::uint8_t unit_;
  std::uint16_t transaction_ = 0;
  int socket_ = -1;
};

}  // namespace

std::unique_ptr<ModbusChannel> make_tcp_channel(const ModbusRig& rig, const std::string& address) {
  return std::make_unique<TcpChannel>(rig, address);
}

}  // namespace upright
