// One row of samples.csv, filled in by the loop, and who may watch the rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace upright {

/// Bits of the column `flags`.
namespace row_flag {
inline constexpr std::uint32_t stale = 1u << 0;      ///< no new counts: the row repeats the last fresh ones
inline constexpr std::uint32_t fault = 1u << 1;      ///< the rig reported a fault: counts as for stale
inline constexpr std::uint32_t saturated = 1u << 2;  ///< the request exceeded the amplifier's limit
inline constexpr std::uint32_t overrun_wake = 1u << 3;     ///< ended late, mainly by waking late
inline constexpr std::uint32_t overrun_read = 1u << 4;     ///< reading ended beyond the period
inline constexpr std::uint32_t overrun_compute = 1u << 5;  ///< computing ended beyond the period
inline constexpr std::uint32_t overrun_write = 1u << 6;    ///< writing ended beyond the period
inline constexpr std::uint32_t missed = 1u << 7;           ///< at least one period before this row has no row
inline constexpr std::uint32_t write_failed = 1u << 8;     ///< the voltage may not have reached the device
inline constexpr std::uint32_t stopped = 1u << 9;  ///< row of the safety stop: zero volts from here on
/// Experiments only: state feedback is active. Without it the voltage is that of the script.
inline constexpr std::uint32_t feedback = 1u << 10;
/// Any of the overruns.
inline constexpr std::uint32_t overrun = overrun_wake | overrun_read | overrun_compute | overrun_write;
/// Rows with these flags did not pass through the controller: the voltage was held.
inline constexpr std::uint32_t held = stale | fault;
}  // namespace row_flag

/// The columns of samples.csv in order.
inline constexpr std::string_view sample_columns =
    "tick,time_s,cart_counts,pendulum_counts,cart_m,theta_rad,cart_velocity_mps,pendulum_rate_radps,"
    "voltage_requested_v,voltage_v,wake_late_us,read_us,compute_us,write_us,flags,sequence";

/// The encoders were read at `time_ns` after the start of the loop; then `voltage_v` was applied and held
/// until the next row.
struct LogRecord {
  std::uint64_t tick = 0;            ///< number of the period
  std::int64_t time_ns = 0;          ///< when the counts were taken, since the start [ns]
  std::int64_t cart_counts = 0;      ///< as read from the device
  std::int64_t pendulum_counts = 0;  ///< of the pendulum's encoder, as the device gave them
  double cart_m = 0.0;               ///< position of the cart [m]
  double theta_rad = 0.0;            ///< angle of the pendulum [rad]
  double cart_velocity_mps = 0.0;    ///< estimated velocity of the cart [m/s]
  double pendulum_rate_radps = 0.0;  ///< estimated rate of the pendulum [rad/s]
  double voltage_requested_v = 0.0;  ///< before the limiter [V]
  double voltage_v = 0.0;            ///< as written to the rig [V]
  std::int64_t wake_late_ns = 0;     ///< lateness of the wake-up [ns]
  std::int64_t read_ns = 0;          ///< how long reading took [ns]
  std::int64_t compute_ns = 0;       ///< how long computing took [ns]
  std::int64_t write_ns = 0;         ///< how long writing took [ns]
  std::uint32_t flags = 0;           ///< bits of row_flag
  std::uint64_t sequence = 0;        ///< sequence number of the rig's readings
};

/// Rows that may wait for the disk, unless a session says otherwise.
inline constexpr std::size_t default_log_queue_rows = 16384;

/// Receives the rows before they are written. Called by the writing thread, which it must not delay: no
/// lock, no waiting.
class RowWatcher {
 public:
  virtual ~RowWatcher() = default;
  /// Called by the writer thread. It must not wait.
  virtual void see(std::span<const LogRecord> rows) noexcept = 0;
};

}  // namespace upright
