// One row of samples.csv as the loop fills it in.
#pragma once

#include <cstdint>
#include <string_view>

namespace upright {

/// Bits of the column `flags`.
namespace row_flag {
inline constexpr std::uint32_t stale = 1u << 0;      ///< no new counts: those shown are the last fresh ones
inline constexpr std::uint32_t fault = 1u << 1;      ///< the rig reported a fault: counts as above
inline constexpr std::uint32_t saturated = 1u << 2;  ///< the request was beyond the amplifier's limit
inline constexpr std::uint32_t overrun_wake = 1u << 3;  ///< cycle ended late, mostly for waking late
inline constexpr std::uint32_t overrun_read = 1u << 4;
inline constexpr std::uint32_t overrun_compute = 1u << 5;
inline constexpr std::uint32_t overrun_write = 1u << 6;
inline constexpr std::uint32_t missed = 1u << 7;  ///< at least one period passed without a row before this
inline constexpr std::uint32_t write_failed = 1u << 8;  ///< the voltage may not have arrived
inline constexpr std::uint32_t stopped = 1u << 9;       ///< the safety stop's row: zero volts from here on
/// Experiments only: the state feedback acts. Without it the voltage is the script's.
inline constexpr std::uint32_t feedback = 1u << 10;
inline constexpr std::uint32_t overrun = overrun_wake | overrun_read | overrun_compute | overrun_write;
/// Rows with these did not go through the controller: the voltage was held.
inline constexpr std::uint32_t held = stale | fault;
}  // namespace row_flag

/// The columns of samples.csv in their order.
inline constexpr std::string_view sample_columns =
    "tick,time_s,cart_counts,pendulum_counts,cart_m,theta_rad,cart_velocity_mps,pendulum_rate_radps,"
    "voltage_requested_v,voltage_v,wake_late_us,read_us,compute_us,write_us,flags,sequence";

/// The encoders were read at `time_ns` after the loop's start; then `voltage_v` was applied and held until
/// the next row.
struct LogRecord {
  std::uint64_t tick = 0;
  std::int64_t time_ns = 0;
  std::int64_t cart_counts = 0;  ///< as the device gave them
  std::int64_t pendulum_counts = 0;
  double cart_m = 0.0;
  double theta_rad = 0.0;
  double cart_velocity_mps = 0.0;
  double pendulum_rate_radps = 0.0;
  double voltage_requested_v = 0.0;
  double voltage_v = 0.0;
  std::int64_t wake_late_ns = 0;
  std::int64_t read_ns = 0;
  std::int64_t compute_ns = 0;
  std::int64_t write_ns = 0;
  std::uint32_t flags = 0;
  std::uint64_t sequence = 0;  ///< of the rig's readings
};

}  // namespace upright
