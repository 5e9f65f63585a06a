// The virtual rig: the plant in real time behind a real Modbus server, over TCP or a serial line, with the
// faults that a link can have on request.
//
// The pendulum and the cart are held at their initial pose, as an operator would, until the controller takes
// over: the first command that is not zero volts, or the amplifier being enabled where the rig has a register
// for that. When a controller that had gone, leaving the motor off, comes back, the operator has put the
// pendulum back. A voltage acts from the moment its request arrived until the next, or until no valid request
// came for the watchdog's time; then the motor is at zero volts. The watchdog's time is what the master
// programmed, the rig file's until then.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Faults of the link, from when the pendulum is let go. Each reply is hit with probability 1/every; 0 is
/// never.
struct InjectedFaults {
  std::uint64_t seed = 1;
  int late_every = 0;
  double late_s = 0.0;
  int drop_every = 0;
  int corrupt_every = 0;  ///< one bit of a reply is wrong
  // Once, this long after the pendulum was let go; 0 is never.
  double restart_after_s = 0.0;  ///< the device restarts
  double cut_after_s = 0.0;      ///< the link is cut, for good
  double stick_after_s = 0.0;    ///< an encoder stops counting, for good
  bool stick_cart = true;        ///< which: the cart's or the pendulum's
  double jump_after_s = 0.0;     ///< the cart's counts jump, for good
  int jump_counts = 0;
  int stale_every = 0;    ///< one reply in so many: the reply before is sent once more in its place
  int reorder_every = 0;  ///< the reply leaves after the next one
};

struct VirtualRigOptions {
  std::string tcp_host;     ///< empty: a serial line
  int tcp_port = 0;         ///< 0: a free one
  std::string serial_line;  ///< a terminal; where nothing exists, a new pseudo-terminal gets this name
  bool pace = true;         ///< a pseudo-terminal takes as long as its baud rate says
  double theta0_rad = 0.0;
  double cart0_m = 0.0;
  /// The pendulum hangs this long after the first request, until the operator lifts it to its initial pose.
  double hang_s = 0.0;
  std::filesystem::path
      trace;  ///< CSV of the plant's side: monotonic_s,voltage_v,cart_m,theta_rad,held; empty: none
  double duration_s = 0.0;  ///< 0: until stopped
  InjectedFaults faults;
  std::function<void(const std::string&)> listening;  ///< called once with "HOST:PORT" or the line's name
};

/// Serves until `stopped`. Throws ConfigError, or DeviceError when the address or the line cannot be had.
void serve_virtual_rig(const RigFile& rig, const Plant& plant, const VirtualRigOptions& options,
                       const std::atomic<bool>& stopped);

}  // namespace upright
