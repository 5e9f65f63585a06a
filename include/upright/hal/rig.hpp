// The seam between the control loop and a rig: what every backend (simulated, modbus, gpio, comedi,
// quanser-hil) implements.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace upright {

/// What a reading is worth.
enum class RigStatus : std::uint8_t {
  fresh,  ///< counts that were taken for this call
  stale,  ///< no new counts: those of an earlier sequence number, not to be used as new
  fault,  ///< no counts at all; `fault` says why
};

/// Why a rig failed. One cause each, so that a stop can name it.
enum class RigFault : std::uint8_t {
  none,
  link_timeout,      ///< no reply within the deadline
  link_lost,         ///< the connection is gone
  corrupt_reply,     ///< a reply failed its check sum or its format
  device_restarted,  ///< the device came back with its counters or its watchdog reset
  counts_jumped,     ///< the counts went somewhere no motion leads to, and stayed there
  device_refused,    ///< the device answered with an exception that will not pass by itself
  device_busy,       ///< the device answered with an exception that says: later
  output_kept,       ///< the device acknowledged zero volts, but its output reads back as another voltage
  not_finite,        ///< a value that is not a finite number was about to be used
  out_of_range,      ///< counts or volts outside what the hardware can mean
  emergency_stop,
  limit_switch,
  limit_switch_plus,   ///< the one at the track's +x end
  limit_switch_minus,  ///< the one at its -x end
  line_failed,         ///< a digital line could not be read or set
  edges_lost,          ///< an encoder's edges passed unseen: its counts are wrong from here on
  edges_too_fast,      ///< an encoder's edges came faster than they may, so that some could be lost
  watchdog_expired,    ///< the device's own watchdog took the voltage away, and keeps it away
};

constexpr bool is_emergency_stop(RigFault fault) noexcept {
  return fault == RigFault::emergency_stop;
}

constexpr bool is_limit_switch(RigFault fault) noexcept {
  return fault == RigFault::limit_switch || fault == RigFault::limit_switch_plus ||
         fault == RigFault::limit_switch_minus;
}

/// Somebody, or the cart, stopped the rig through one of its inputs: nothing is wrong with its link.
constexpr bool is_safety_input(RigFault fault) noexcept {
  return is_emergency_stop(fault) || is_limit_switch(fault);
}

/// One exchange with the encoders. Counts are the device's own, `width` bits wide, not unwrapped.
struct RigReading {
  std::int64_t cart_counts = 0;
  std::int64_t pendulum_counts = 0;
  std::int64_t time_ns = 0;    ///< when the counts were taken, on the clock the loop runs on
  std::uint64_t sequence = 0;  ///< grows with each fresh reading
  /// How often the link was brought back since the rig was opened: connected anew, or back in step.
  std::uint32_t recoveries = 0;
  RigStatus status = RigStatus::fault;
  RigFault fault = RigFault::none;
};

/// Which digital inputs a rig has that stop the motor. While one is active every reading is a fault that
/// names it.
struct SafetyInputs {
  bool emergency_stop = false;
  int limit_switches = 0;
};

/// What a device says of itself, for the record of a run: "serial_number" and its text, ...
using DeviceFacts = std::vector<std::pair<std::string, std::string>>;

/// What is known of a stop. Zero volts is confirmed when the device has taken it and, where its output can be
/// read back, when that reads zero.
struct StopReport {
  bool zero_confirmed = false;
  bool read_back = false;  ///< the output reads zero; false: the device's acknowledgement is all there is
  bool disabled = true;    ///< the amplifier is disabled, or nothing here can disable it
  /// The device's own watchdog takes the voltage away so long after the last request, as was programmed [s];
  /// 0: it has none.
  double watchdog_s = 0.0;
  bool watchdog_read_back = true;   ///< its time was read back, too; false: the device has accepted it
  RigFault fault = RigFault::none;  ///< of the latest attempt: why zero volts is not confirmed
  int exception = 0;                ///< behind a fault: the number that the device answered with

  bool done() const noexcept { return zero_confirmed && disabled; }
};

/// Of a rig that has no voltage to take away, or that cannot fail to.
constexpr StopReport at_zero_volts() noexcept {
  StopReport report;
  report.zero_confirmed = true;
  return report;
}

/// A rig as the loop sees it. `open` may throw Error and take its time; everything else is called from the
/// real-time thread and neither allocates, locks, throws nor blocks beyond the deadline the backend was
/// opened with.
class Rig {
 public:
  virtual ~Rig() = default;
  /// Connects, checks what can be checked, leaves the motor at zero volts.
  virtual void open() = 0;
  virtual RigReading read() noexcept = 0;
  /// Commands a voltage that the limiter has passed. A value that is not finite is refused and becomes zero
  /// volts.
  virtual RigFault write(double voltage_v) noexcept = 0;
  /// Begins to put out zero volts and to disable the amplifier, by every means the backend has, and says what
  /// is known of it so far. It never waits for an answer: call it again until the report is done. A backend
  /// that has to wait goes on trying by itself, until the rig is opened again or destroyed.
  virtual StopReport stop() noexcept = 0;
  /// Outside the loop: somebody has moved cart or pendulum of an open rig, its counts go on from elsewhere. A
  /// rig around another one passes it on.
  virtual void moved_by_hand() noexcept {}
  /// The number of the exception that the device answered with last; 0: none. A rig around another one passes
  /// on that one's.
  virtual int last_exception() const noexcept { return 0; }
  /// What is wired, of an open rig. A rig around another one passes on that one's.
  virtual SafetyInputs safety_inputs() const noexcept { return {}; }
  /// Of an open rig, outside the loop. A rig around another one passes on that one's.
  virtual DeviceFacts device_facts() const { return {}; }
};

}  // namespace upright
