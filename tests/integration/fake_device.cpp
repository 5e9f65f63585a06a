#include "fake_device.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

#include "hal/modbus/registers.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {

namespace {

constexpr std::uint8_t unit = 1;
constexpr int voltage_address = 16, enable_address = 17, watchdog_address = 18, registers_there = 64;
constexpr int read_holding = 3, write_single = 6, write_multiple = 16, read_write = 23;

std::uint16_t word_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return static_cast<std::uint16_t>(256u * bytes.at(at) + bytes.at(at + 1));
}

void add_word(std::vector<std::uint8_t>& bytes, std::uint16_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

std::uint16_t check_sum(const std::vector<std::uint8_t>& bytes, std::size_t size) {
  std::uint16_t sum = 0xffff;
  for (std::size_t i = 0; i < size; ++i) {
    sum ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit)
      sum = static_cast<std::uint16_t>((sum & 1u) != 0 ? sum >> 1 ^ 0xa001 : sum >> 1);
  }
  return sum;
}

/// How long a request's PDU is; 0: not to be told yet.
std::size_t request_size(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  if (bytes.size() <= at) return 0;
  const int function = bytes[at];
  if (function == write_multiple) return bytes.size() > at + 5 ? 6u + bytes[at + 5] : 0;
  if (function == read_write) return bytes.size() > at + 9 ? 10u + bytes[at + 9] : 0;
  return 5;
}

bool writes(int function) {
  return function == write_single || function == write_multiple || function == read_write;
}

}  // namespace

FakeDevice::FakeDevice(const FakeDeviceOptions& options) : options_(options), registers_(registers_there, 0) {
  registers_[4] = 77;
  if (options.has_plant) {
    constexpr double lean_rad = 0.03;
    const RigFile file = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml");
    plant_ = make_simulated_rig(file, clock_, {1, lean_rad});
    plant_->open();
  }
  if (options.serial)
    open_line();
  else
    listen_tcp();
  thread_ = std::thread([this] { serve(); });
}

FakeDevice::~FakeDevice() {
  ending_ = true;
  thread_.join();
  for (Peer& peer : peers_) ::close(peer.descriptor);
  for (const int descriptor : {listener_, slave_})
    if (descriptor >= 0) ::close(descriptor);
}

void FakeDevice::listen_tcp() {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port_));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 16) != 0)
    throw std::runtime_error("no port for the device");
  ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
}

void FakeDevice::open_line() {
  termios raw{};
  cfmakeraw(&raw);
  char name[128] = "";
  if (openpty(&master_, &slave_, name, &raw, nullptr) != 0) throw std::runtime_error("no pseudo-terminal");
  fcntl(master_, F_SETFL, O_NONBLOCK);
  fcntl(master_, F_SETFD, FD_CLOEXEC);
  fcntl(slave_, F_SETFD, FD_CLOEXEC);
  line_ = name;
  peers_.push_back({master_, {}});
}

std::string FakeDevice::rig_text(double response_timeout_s) const {
  const std::filesystem::path rigs = UPRIGHT_SOURCE_DIR "/config/rigs";
  std::string text = text_of(rigs / (options_.serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml"));
  text = options_.serial ? replaced(text, "/dev/ttyUSB0", line_)
                         : replaced(text, "port: 1502", "port: " + std::to_string(port_));
  text = replaced(text, options_.serial ? "response_timeout_s: 0.002" : "response_timeout_s: 0.0008",
                  "response_timeout_s: " + std::to_string(response_timeout_s));
  if (options_.has_watchdog) return text;
  return replaced(text, "  device_watchdog: {address: 18, time_s: 0.1, seconds_per_count: 0.001}\n", "");
}

void FakeDevice::begin(Trouble trouble, double for_s) {
  const std::lock_guard lock(mutex_);
  trouble_ = trouble;
  trouble_until_s_ = monotonic_s() + for_s;
}

Trouble FakeDevice::trouble_now() const {
  const std::lock_guard lock(mutex_);
  return monotonic_s() < trouble_until_s_ ? trouble_ : Trouble::none;
}

std::vector<FakeDevice::Held> FakeDevice::record() const {
  const std::lock_guard lock(mutex_);
  return record_;
}

double FakeDevice::voltage_v() const {
  const std::lock_guard lock(mutex_);
  return voltage_v_;
}

bool FakeDevice::enabled() const {
  const std::lock_guard lock(mutex_);
  return registers_[enable_address] != 0;
}

double FakeDevice::voltage_since_s() const {
  const std::lock_guard lock(mutex_);
  return voltage_since_s_;
}

void FakeDevice::serve() {
  while (!ending_) {
    if (!options_.serial) attend_listener();
    std::vector<pollfd> watched;
    if (listener_ >= 0) watched.push_back({listener_, POLLIN, 0});
    for (const Peer& peer : peers_) watched.push_back({peer.descriptor, POLLIN, 0});
    ::poll(watched.data(), watched.size(), 1);
    watch();
    for (Peer& peer : peers_)
      if (!read_from(peer) || !take_requests(peer)) drop(peer, false);
    std::erase_if(peers_, [](const Peer& peer) { return peer.descriptor < 0; });
  }
}

void FakeDevice::attend_listener() {
  const bool refuses = trouble_now() == Trouble::refuses_connections;
  if (refuses && listener_ >= 0) {
    ::close(listener_);
    listener_ = -1;
    for (Peer& peer : peers_) drop(peer, true);
    peers_.clear();
  }
  if (refuses) return;
  if (listener_ < 0) listen_tcp();
  pollfd waiting{listener_, POLLIN, 0};
  while (::poll(&waiting, 1, 0) > 0) {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (client < 0) return;
    const int on = 1;
    setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    peers_.push_back({client, {}});
  }
}

/// Its own watchdog takes the voltage away.
void FakeDevice::watch() {
  const std::lock_guard lock(mutex_);
  const double time_s = 1e-3 * registers_[watchdog_address];
  if (!options_.has_watchdog || time_s == 0.0 || voltage_v_ == 0.0 || monotonic_s() - fed_s_ < time_s) return;
  registers_[voltage_address] = 0;
  hold(0.0);
}

void FakeDevice::hold(double voltage_v) {
  const double now_s = monotonic_s();
  record_.push_back({now_s, voltage_v});
  if (voltage_v != voltage_v_) voltage_since_s_ = now_s;
  voltage_v_ = voltage_v;
  const bool begins = voltage_v != 0.0;
  if (!plant_ || (!let_go_ && !begins)) return;
  let_go_ = true;
  plant_->write(voltage_v);
}

/// The plant under the voltage so far, and its counts into the registers.
void FakeDevice::move() {
  if (!plant_) return;
  const RigReading reading = plant_->read();
  encode_counter(reading.cart_counts, {}, {registers_.data(), 2});
  encode_counter(reading.pendulum_counts, {}, {registers_.data() + 2, 2});
}

bool FakeDevice::read_from(Peer& peer) {
  std::uint8_t part[512];
  for (;;) {
    const ssize_t got = ::read(peer.descriptor, part, sizeof part);
    if (got > 0) {
      peer.bytes.insert(peer.bytes.end(), part, part + got);
      continue;
    }
    return options_.serial || (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK));
  }
}

bool FakeDevice::take_requests(Peer& peer) {
  std::vector<std::uint8_t> header, pdu;
  while (take_frame(peer, header, pdu))
    if (!answer(peer, header, pdu)) return false;
  return true;
}

bool FakeDevice::take_frame(Peer& peer, std::vector<std::uint8_t>& header,
                            std::vector<std::uint8_t>& pdu) const {
  const std::size_t begin = options_.serial ? 1 : 7, end = options_.serial ? 2 : 0;
  const std::size_t size = request_size(peer.bytes, begin);
  if (size == 0 || peer.bytes.size() < begin + size + end) return false;
  const auto at = [&](std::size_t i) { return peer.bytes.begin() + static_cast<std::ptrdiff_t>(i); };
  header.assign(at(0), at(begin));
  pdu.assign(at(begin), at(begin + size));
  peer.bytes.erase(at(0), at(begin + size + end));
  return true;
}

/// False: the connection is to end.
bool FakeDevice::answer(Peer& peer, const std::vector<std::uint8_t>& header,
                        const std::vector<std::uint8_t>& pdu) {
  const Trouble trouble = trouble_now();
  const bool mute = trouble == Trouble::silent || trouble == Trouble::refuses_connections;
  if (mute) return true;
  if (trouble == Trouble::resets) {
    if (options_.serial) return ::write(peer.descriptor, "\x55\xaa\x55", 3) >= 0;
    drop(peer, true);
    return false;
  }
  send(peer, header, reply_to(pdu, trouble), trouble);
  return true;
}

std::vector<std::uint8_t> FakeDevice::reply_to(const std::vector<std::uint8_t>& pdu, Trouble trouble) {
  const std::lock_guard lock(mutex_);
  const int function = pdu[0];
  const auto exception = [&](std::uint8_t number) {
    return std::vector<std::uint8_t>{static_cast<std::uint8_t>(function | 0x80), number};
  };
  if (trouble == Trouble::busy) return exception(6);
  if (trouble == Trouble::gateway_silent) return exception(0x0b);
  if (trouble == Trouble::refuses_writes && writes(function)) return exception(4);
  if (trouble == Trouble::refuses_read_write && function == read_write) return exception(1);
  fed_s_ = monotonic_s();
  move();
  const bool obeys = trouble != Trouble::ignores_writes;
  std::vector<std::uint8_t> reply = {pdu[0]};
  if (function == write_single) {
    store(word_at(pdu, 1), word_at(pdu, 3), obeys);
    return pdu;
  }
  if (function == write_multiple || function == read_write) {
    const std::size_t from = function == write_multiple ? 1 : 5;
    for (int i = 0; i < word_at(pdu, from + 2); ++i)
      store(word_at(pdu, from) + i, word_at(pdu, from + 5 + 2 * static_cast<std::size_t>(i)), obeys);
    if (function == write_multiple) {
      reply.insert(reply.end(), pdu.begin() + 1, pdu.begin() + 5);
      return reply;
    }
  }
  if (function != read_holding && function != read_write) return exception(1);
  const int first = word_at(pdu, 1), count = word_at(pdu, 3);
  if (first + count > registers_there) return exception(2);
  if (!options_.reads_back && first <= voltage_address && first + count > voltage_address)
    return exception(2);
  reply.push_back(static_cast<std::uint8_t>(2 * count));
  for (int i = first; i < first + count; ++i) add_word(reply, registers_[static_cast<std::size_t>(i)]);
  return reply;
}

bool FakeDevice::store(int address, std::uint16_t word, bool obeys) {
  if (address >= registers_there || !obeys) return false;
  registers_[static_cast<std::size_t>(address)] = word;
  if (address == voltage_address) hold(1e-3 * static_cast<std::int16_t>(word));
  return true;
}

void FakeDevice::send(Peer& peer, const std::vector<std::uint8_t>& header, std::vector<std::uint8_t> pdu,
                      Trouble trouble) const {
  if (trouble == Trouble::wrong_echo && pdu.size() > 2) pdu[2] ^= 1u;
  if (trouble == Trouble::wrong_echo && (pdu[0] == read_holding || pdu[0] == read_write)) pdu[1] ^= 2u;
  const auto answering = static_cast<std::uint8_t>(trouble == Trouble::wrong_unit ? unit + 1 : unit);
  std::vector<std::uint8_t> frame;
  if (options_.serial) {
    frame.push_back(answering);
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    const std::uint16_t sum = check_sum(frame, frame.size());
    frame.push_back(static_cast<std::uint8_t>(sum ^ (trouble == Trouble::wrong_protocol ? 1u : 0u)));
    frame.push_back(static_cast<std::uint8_t>(sum >> 8));
    if (trouble == Trouble::wrong_length) frame.resize(frame.size() / 2);
  } else {
    frame.assign(header.begin(), header.begin() + 2);
    add_word(frame, trouble == Trouble::wrong_protocol ? 1 : 0);
    const std::size_t length = pdu.size() + (trouble == Trouble::wrong_length ? 3 : 1);
    add_word(frame, static_cast<std::uint16_t>(length));
    frame.push_back(answering);
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    if (trouble == Trouble::wrong_length) frame.insert(frame.end(), 2, std::uint8_t{0});
  }
  if (::write(peer.descriptor, frame.data(), frame.size()) < 0 && !options_.serial) drop(peer, false);
}

void FakeDevice::drop(Peer& peer, bool with_reset) const {
  if (options_.serial || peer.descriptor < 0) return;
  const linger at_once{1, 0};
  if (with_reset) setsockopt(peer.descriptor, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  ::close(peer.descriptor);
  peer.descriptor = -1;
}

}  // namespace upright::test
