// `--stream`: each row of the log as a UDP datagram with JSON, as PlotJuggler's UDP server reads it.
//
// The log's writer thread sends, and never waits: a datagram for which the socket has no room at once is
// dropped and counted. The loop does nothing for the stream.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <atomic>
#include <cstdint>
#include <string>

#include "record/run_log.hpp"

namespace upright {

class UdpStream final : public RowWatcher {
 public:
  /// `address`: udp://HOST:PORT. Throws ConfigError for what is no such address, DeviceError where no socket
  /// can be opened.
  explicit UdpStream(const std::string& address);
  ~UdpStream() override;
  UdpStream(const UdpStream&) = delete;
  UdpStream& operator=(const UdpStream&) = delete;

  void see(std::span<const LogRecord> rows) noexcept override;

  const std::string& address() const { return address_; }
  std::uint64_t sent() const noexcept { return sent_.load(std::memory_order_relaxed); }
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::string address_;
  sockaddr_storage to_{};
  socklen_t to_length_ = 0;
  int socket_ = -1;
  std::atomic<std::uint64_t> sent_{0}, dropped_{0};
};

}  // namespace upright
