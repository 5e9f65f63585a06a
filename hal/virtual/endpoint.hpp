// Where a virtual rig's masters are: TCP clients, or one serial line. Replies leave in order, at their time.
#pragma once

#include <modbus.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/virtual_rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// A file descriptor with an owner.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.number_) { other.number_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();
  int get() const { return number_; }

 private:
  int number_;
};

struct Reply {
  std::int64_t leaves_ns = 0;
  std::vector<std::uint8_t> bytes;
};

/// One master: what it is connected by, and the replies on their way to it.
struct Peer {
  Descriptor descriptor;
  std::deque<Reply> replies;
  std::optional<Reply> withheld;  ///< leaves after the next one
  bool gone = false;
};

using ModbusContext = std::unique_ptr<modbus_t, void (*)(modbus_t*)>;

/// Opens the listening socket or the line, and makes the libmodbus context that speaks there.
class Endpoint {
 public:
  Endpoint(const RigFile& rig, const VirtualRigOptions& options);
  ~Endpoint();
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  const std::string& name() const { return name_; }
  modbus_t* context() const { return context_.get(); }
  bool serial() const { return listener_.get() < 0; }
  int listener() const { return listener_.get(); }
  std::vector<Peer>& peers() { return peers_; }
  /// Takes a waiting TCP client. True when there was one.
  bool accept_client();
  /// How long `bytes` take on the line; 0 where the line takes its time itself.
  std::int64_t line_time_ns(std::size_t bytes) const;

 private:
  void listen_tcp(const std::string& host, int port);
  void open_line(const ModbusRig& modbus, const std::string& line);

  ModbusContext context_;
  Descriptor listener_;
  Descriptor far_end_;  // keeps a new pseudo-terminal alive while no master has it open
  std::vector<Peer> peers_;
  std::string name_;
  std::string link_made_;
  double ns_per_byte_ = 0.0;
  bool pace_;
};

}  // namespace upright
