#include "udp_stream.hpp"

#include <netdb.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <string_view>

#include "row_json.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

/// The host and the port of udp://HOST:PORT; an IPv6 address stands in brackets.
struct UdpAddress {
  std::string host, port;
};

UdpAddress parse_udp_address(const std::string& text) {
  constexpr std::string_view scheme = "udp://";
  constexpr int highest_port = 65535;
  const std::size_t colon = text.rfind(':');
  if (text.starts_with(scheme) && colon > scheme.size() && colon != std::string::npos) {
    UdpAddress address{text.substr(scheme.size(), colon - scheme.size()), text.substr(colon + 1)};
    if (address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']')
      address.host = address.host.substr(1, address.host.size() - 2);
    int port = 0;
    const char* end = address.port.data() + address.port.size();
    const auto read = std::from_chars(address.port.data(), end, port);
    if (read.ec == std::errc{} && read.ptr == end && port > 0 && port <= highest_port) return address;
  }
  throw ConfigError("'" + text +
                    "' is no address for --stream: give udp://HOST:PORT, as udp://127.0.0.1:9870");
}

}  // namespace

UdpStream::UdpStream(const std::string& address) : address_(address) {
  const UdpAddress parsed = parse_udp_address(address);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int problem = ::getaddrinfo(parsed.host.c_str(), parsed.port.c_str(), &wanted, &found);
  if (problem != 0 || found == nullptr)
    throw ConfigError("the host of " + address + " is not known (" + ::gai_strerror(problem) +
                      "): check the name, or give its number");
  std::memcpy(&to_, found->ai_addr, found->ai_addrlen);
  to_length_ = found->ai_addrlen;
  socket_ = ::socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  ::freeaddrinfo(found);
  if (socket_ < 0)
    throw DeviceError("no socket can be opened for " + address + " (" + std::strerror(errno) +
                      "): run without --stream");
}

UdpStream::~UdpStream() {
  ::close(socket_);
}

void UdpStream::see(std::span<const LogRecord> rows) noexcept {
  char text[longest_row_json];
  for (const LogRecord& row : rows) {
    const std::size_t size = format_row_json(row, text);
    const ssize_t done = ::sendto(socket_, text, size, MSG_DONTWAIT | MSG_NOSIGNAL,
                                  reinterpret_cast<const sockaddr*>(&to_), to_length_);
    (done == static_cast<ssize_t>(size) ? sent_ : dropped_).fetch_add(1, std::memory_order_relaxed);
  }
}

}  // namespace upright
