#include "endpoint.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "upright/base/error.hpp"

namespace upright {

namespace {

constexpr std::uint32_t partial_request_us = 20'000;  // a request that stops in the middle is given up
constexpr std::uint32_t exception_pause_us =
    100;  // libmodbus sleeps this long before it reports an exception
constexpr int max_clients = 8;

std::string reason() {
  return std::strerror(errno);
}

void configure(modbus_t* context, int unit) {
  modbus_set_slave(context, unit);
  modbus_set_error_recovery(context, MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_response_timeout(context, 0, exception_pause_us);
  modbus_set_byte_timeout(context, 0, partial_request_us);
  modbus_set_indication_timeout(context, 0, partial_request_us);
}

bool is_pseudo_terminal(int descriptor) {
  constexpr unsigned first_major = 136, last_major = 143;
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return false;
  return major(status.st_rdev) >= first_major && major(status.st_rdev) <= last_major;
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

Endpoint::Endpoint(const RigFile& rig, const VirtualRigOptions& options)
    : context_(nullptr, modbus_free), pace_(options.pace) {
  if (options.serial_line.empty())
    listen_tcp(options.tcp_host, options.tcp_port);
  else
    open_line(*rig.modbus, options.serial_line);
  if (!context_) throw DeviceError("no Modbus context could be created: free memory");
  configure(context_.get(), rig.modbus->unit);
}

Endpoint::~Endpoint() {
  if (!link_made_.empty()) unlink(link_made_.c_str());
}

void Endpoint::listen_tcp(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1)
    throw ConfigError("'" + host +
                      "' is not a numeric IPv4 address: use one such as 127.0.0.1:1502 with --tcp");
  listener_ = Descriptor(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t size = sizeof address;
  if (bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      listen(listener_.get(), max_clients) != 0)
    throw DeviceError("cannot listen on " + host + ":" + std::to_string(port) + " (" + reason() +
                      "): choose another port, or 0 for any free port");
  getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size);
  name_ = host + ":" + std::to_string(ntohs(address.sin_port));
  context_.reset(modbus_new_tcp(nullptr, ntohs(address.sin_port)));
}

void Endpoint::open_line(const ModbusRig& modbus, const std::string& line) {
  if (modbus.baud == 0)
    throw ConfigError(
        "the rig file has no baud rate, which --rtu requires: use a rig file with backend modbus-rtu");
  const char parity = modbus.parity == Parity::none ? 'N' : modbus.parity == Parity::even ? 'E' : 'O';
  context_.reset(modbus_new_rtu(line.c_str(), modbus.baud, parity, 8, modbus.stop_bits));
  const double bits = 1.0 + 8.0 + (parity == 'N' ? 0.0 : 1.0) + modbus.stop_bits;
  name_ = line;
  int descriptor = -1;
  if (access(line.c_str(), F_OK) == 0) {
    if (!context_ || modbus_connect(context_.get()) != 0)
      throw DeviceError("cannot open " + line + " (" + reason() + "): check the line and its permissions");
    descriptor = modbus_get_socket(context_.get());
    pace_ = pace_ && is_pseudo_terminal(descriptor);
  } else {
    descriptor = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    std::array<char, 128> far_name{};
    if (descriptor < 0 || grantpt(descriptor) != 0 || unlockpt(descriptor) != 0 ||
        ptsname_r(descriptor, far_name.data(), far_name.size()) != 0)
      throw DeviceError("no pseudo-terminal can be opened (" + reason() + "): check /dev/pts");
    far_end_ = Descriptor(::open(far_name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
    termios settings{};
    tcgetattr(far_end_.get(), &settings);
    cfmakeraw(&settings);
    tcsetattr(far_end_.get(), TCSANOW, &settings);
    unlink(line.c_str());  // a link that leads nowhere any more
    if (symlink(far_name.data(), line.c_str()) != 0)
      throw DeviceError("cannot create " + line + " (" + reason() +
                        "): check the folder and its permissions");
    link_made_ = line;
  }
  if (pace_) ns_per_byte_ = 1e9 * bits / modbus.baud;
  Peer peer;
  peer.descriptor = Descriptor(descriptor);
  peers_.push_back(std::move(peer));
}

bool Endpoint::accept_client() {
  Descriptor client(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  if (client.get() < 0) return false;
  const int on = 1;
  setsockopt(client.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (peers_.size() >= max_clients) peers_.erase(peers_.begin());
  Peer peer;
  peer.descriptor = std::move(client);
  peers_.push_back(std::move(peer));
  return true;
}

std::int64_t Endpoint::line_time_ns(std::size_t bytes) const {
  return static_cast<std::int64_t>(ns_per_byte_ * static_cast<double>(bytes));
}

}  // namespace upright
