// The interface between the control loop and a rig, implemented by each backend (simulated, modbus, gpio,
// comedi, quanser-hil).
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace upright {

/// Validity of a reading.
enum class RigStatus : std::uint8_t {
  fresh,  ///< counts taken for this call
  stale,  ///< no new counts: those of an earlier sequence number, not to be used as new ones
  fault,  ///< no counts; `fault` gives the cause
};

/// Why a rig failed: one enumerator per cause, so that a stop can name it.
enum class RigFault : std::uint8_t {
  none,
  link_timeout,      ///< no reply within the deadline
  link_lost,         ///< the connection is gone
  corrupt_reply,     ///< a reply failed its check sum or its format
  device_restarted,  ///< the device came back with its counters or its watchdog reset
  counts_jumped,     ///< the counts changed to an implausible value, and stayed there
  device_refused,    ///< the device answered with a permanent exception
  device_busy,       ///< the device answered with an exception that means: retry later
  output_kept,       ///< the device acknowledged zero volts, but its output reads back as another voltage
  not_finite,        ///< a value about to be used was not finite
  out_of_range,      ///< counts or volts outside the range of the hardware
  emergency_stop,
  limit_switch,
  limit_switch_plus,   ///< at the track's +x end
  limit_switch_minus,  ///< at the track's -x end
  line_failed,         ///< a digital line could not be read or set
  edges_lost,          ///< edges of an encoder were lost: its counts are wrong from here on
  edges_too_fast,      ///< edges of an encoder came faster than allowed, so that some could be lost
  watchdog_expired,    ///< the device's own watchdog has switched the voltage off, and keeps it off
};

/// True for a fault that the emergency stop causes.
constexpr bool is_emergency_stop(RigFault fault) noexcept {
  return fault == RigFault::emergency_stop;
}

/// True for a fault that a limit switch causes.
constexpr bool is_limit_switch(RigFault fault) noexcept {
  return fault == RigFault::limit_switch || fault == RigFault::limit_switch_plus ||
         fault == RigFault::limit_switch_minus;
}

/// True for faults that an operator or the cart causes through an input: the link is intact.
constexpr bool is_safety_input(RigFault fault) noexcept {
  return is_emergency_stop(fault) || is_limit_switch(fault);
}

/// One exchange with the encoders. Counts are the device's own, of its counter width, not unwrapped.
struct RigReading {
  std::int64_t cart_counts = 0;      ///< of the cart's encoder
  std::int64_t pendulum_counts = 0;  ///< of the pendulum's encoder
  /// As the device measures it [1/s]; not a number: it measures no velocities.
  double cart_counts_per_s = std::numeric_limits<double>::quiet_NaN();
  double pendulum_counts_per_s = std::numeric_limits<double>::quiet_NaN();  ///< the same of the pendulum's
  std::int64_t time_ns = 0;    ///< when the counts were taken, on the loop's clock
  std::uint64_t sequence = 0;  ///< increases with each fresh reading
  /// How often the link was recovered since the rig was opened: reconnected or resynchronised.
  std::uint32_t recoveries = 0;
  RigStatus status = RigStatus::fault;  ///< whether the counts are new
  RigFault fault = RigFault::none;      ///< cause of a fault; `none` otherwise
};

/// A sample that a device took on its own time.
struct DeviceSample {
  std::uint64_t number = 0;  ///< grows by one with each sample that arrived; 0: none has arrived yet
  std::int64_t time_ns = 0;  ///< when it arrived, on the clock the loop runs on
};

/// Which digital inputs a rig has that stop the motor. While one is active every reading is a fault that
/// names it.
struct SafetyInputs {
  bool emergency_stop = false;  ///< wired, and stops the motor
  int limit_switches = 0;       ///< how many are wired
};

/// Identification of a device for the record of a run: "serial_number" and its text, ...
using DeviceFacts = std::vector<std::pair<std::string, std::string>>;

/// The state of a stop. Zero volts is confirmed when the device has accepted it and, if its output can be
/// read back, when that reads zero.
struct StopReport {
  bool zero_confirmed = false;  ///< the device is known to be at zero volts
  bool read_back = false;       ///< the output reads zero; false: only the device's acknowledgement is known
  bool disabled = true;         ///< the amplifier is disabled, or the backend cannot disable it
  /// Programmed time after the last request at which the device's own watchdog switches the voltage off
  /// [s]; 0: it has no watchdog.
  double watchdog_s = 0.0;
  bool watchdog_read_back = true;   ///< its time was read back, too; false: the device has only accepted it
  RigFault fault = RigFault::none;  ///< of the latest attempt: why zero volts is not confirmed
  int exception = 0;                ///< the exception code of the device that caused the fault

  bool done() const noexcept { return zero_confirmed && disabled; }
};

/// For a rig that has no voltage to switch off, or that cannot fail to do so.
constexpr StopReport at_zero_volts() noexcept {
  StopReport report;
  report.zero_confirmed = true;
  return report;
}

/// A rig as seen by the loop. `open` may throw Error and may take long. All other functions are called
/// from the real-time thread; they do not allocate, lock or throw, and do not block beyond the deadline
/// with which the backend was opened.
class Rig {
 public:
  virtual ~Rig() = default;
  /// Connects, checks the device, and sets the motor to zero volts.
  virtual void open() = 0;
  virtual RigReading read() noexcept = 0;  ///< the newest counts. A fault is a status, not an exception.
  /// Commands a voltage from the limiter. A value that is not finite is refused and replaced by zero
  /// volts.
  virtual RigFault write(double voltage_v) noexcept = 0;
  /// Begins to set zero volts and to disable the amplifier, by all means that the backend has, and
  /// returns the state so far. It never waits for a reply: call it again until the report is done. If
  /// replies are pending, the backend continues by itself until the rig is opened again or destroyed.
  virtual StopReport stop() noexcept = 0;
  /// Outside the loop: an operator has moved the cart or the pendulum of an open rig, so that its counts
  /// have changed. A decorator forwards the call.
  virtual void moved_by_hand() noexcept {}
  /// The exception code that the device answered with last; 0: none. A decorator forwards the
  /// call.
  virtual int last_exception() const noexcept { return 0; }
  /// The inputs that are wired, of an open rig. A decorator forwards the call.
  virtual SafetyInputs safety_inputs() const noexcept { return {}; }
  /// Of an open rig, outside the loop. A decorator forwards the call.
  virtual DeviceFacts device_facts() const { return {}; }
  /// The device samples on its own time, and the loop waits for each sample with `wait_next` before it reads.
  /// False: the loop follows the computer's clock. Of an open rig; a rig around another one passes on that
  /// one's.
  virtual bool is_clock() const noexcept { return false; }
  /// Readings hold the velocities of both encoders, as the device measures them. Of an open rig; a rig around
  /// another one passes it on.
  virtual bool measures_velocities() const noexcept { return false; }
  /// Waits for a sample that this function has not returned yet, at most until `until_ns`. Returns the newest
  /// sample, which has the number returned before where no new one came. A rig around another one passes it
  /// on.
  virtual DeviceSample wait_next(std::int64_t /*until_ns*/) noexcept { return {}; }
};

}  // namespace upright
