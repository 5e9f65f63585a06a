// A Modbus device of the tests' own, over TCP or behind a pseudo-terminal, that misbehaves when it is told to
// and keeps its own record of every voltage it accepted and held. Its frames are its own: neither libmodbus
// nor the program's.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "upright/hal/clock.hpp"
#include "upright/hal/simulated_rig.hpp"

namespace upright::test {

enum class Trouble {
  none,
  busy,                 ///< exception 06 to every request
  gateway_silent,       ///< exception 0B to every request
  refuses_writes,       ///< exception 04 to everything that writes
  refuses_read_write,   ///< exception 01 to function 0x17
  refuses_connections,  ///< TCP: nobody listens; a serial line is silent
  resets,               ///< TCP: a reset for each request; a serial line answers with noise
  silent,               ///< no reply, nothing obeyed
  ignores_writes,       ///< acknowledges and does not obey
  wrong_unit,           ///< obeys; the reply is another unit's
  wrong_protocol,       ///< obeys; TCP: another protocol in the header; serial: a wrong check sum
  wrong_length,         ///< obeys; TCP: a wrong length in the header; serial: half a frame
  wrong_echo,           ///< obeys; a write's reply repeats another address, a read's has another size
};

struct FakeDeviceOptions {
  bool serial = false;
  bool has_watchdog = false;  ///< its own, programmed by register 18 in milliseconds
  bool reads_back = true;     ///< false: exception 02 for reading the voltage's register
  bool has_plant = false;     ///< a pendulum behind its counters, which is let go with the first voltage
};

/// Registers as in config/rigs/modbus-*.yaml: counters from 0, boot count 4, voltage 16 (mV), enable 17,
/// watchdog 18.
class FakeDevice {
 public:
  explicit FakeDevice(const FakeDeviceOptions& options);
  ~FakeDevice();
  FakeDevice(const FakeDevice&) = delete;
  FakeDevice& operator=(const FakeDevice&) = delete;

  int port() const { return port_; }
  const std::string& line() const { return line_; }
  /// The rig file of either link, pointed at this device. A reply may take `response_timeout_s`.
  std::string rig_text(double response_timeout_s) const;

  /// From now on, for so long.
  void begin(Trouble trouble, double for_s);
  void end_trouble() { begin(Trouble::none, 0.0); }

  /// A voltage that came in a request which was obeyed, or zero by its own watchdog.
  struct Held {
    double time_s = 0.0;
    double voltage_v = 0.0;
  };
  std::vector<Held> record() const;
  /// What is on its output now.
  double voltage_v() const;
  bool enabled() const;
  /// When the voltage became what it is.
  double voltage_since_s() const;

 private:
  struct Peer {
    int descriptor = -1;
    std::vector<std::uint8_t> bytes;
  };

  void listen_tcp();
  void open_line();
  void serve();
  void attend_listener();
  bool read_from(Peer& peer);
  bool take_requests(Peer& peer);
  bool take_frame(Peer& peer, std::vector<std::uint8_t>& header, std::vector<std::uint8_t>& pdu) const;
  bool answer(Peer& peer, const std::vector<std::uint8_t>& header, const std::vector<std::uint8_t>& pdu);
  std::vector<std::uint8_t> reply_to(const std::vector<std::uint8_t>& pdu, Trouble trouble);
  bool store(int address, std::uint16_t word, bool obeys);
  void hold(double voltage_v);
  void move();
  void send(Peer& peer, const std::vector<std::uint8_t>& header, std::vector<std::uint8_t> pdu,
            Trouble trouble) const;
  void watch();
  Trouble trouble_now() const;
  void drop(Peer& peer, bool with_reset) const;

  FakeDeviceOptions options_;
  int listener_ = -1, master_ = -1, slave_ = -1, port_ = 0;
  std::string line_;
  std::vector<Peer> peers_;
  std::atomic<bool> ending_{false};
  mutable std::mutex mutex_;  // of what follows
  Trouble trouble_ = Trouble::none;
  double trouble_until_s_ = 0.0;
  std::vector<std::uint16_t> registers_;
  MonotonicClock clock_;
  std::unique_ptr<Rig> plant_;
  bool let_go_ = false;
  std::vector<Held> record_;
  double voltage_v_ = 0.0, voltage_since_s_ = 0.0, fed_s_ = 0.0;
  std::thread thread_;
};

}  // namespace upright::test
