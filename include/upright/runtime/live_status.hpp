// What a run shows while it goes on, and the signals that end it.
#pragma once

#include <atomic>
#include <functional>

#include "upright/hal/rig.hpp"

namespace upright {

/// The latest values of the loop, for display. The loop writes each field separately; others read it.
struct LiveStatus {
  std::atomic<double> time_s{0.0};         ///< since the start
  std::atomic<double> cart_m{0.0};         ///< position of the cart
  std::atomic<double> theta_rad{0.0};      ///< angle of the pendulum
  std::atomic<double> voltage_v{0.0};      ///< after the limiter
  std::atomic<double> worst_late_us{0.0};  ///< latest wake-up so far
  std::atomic<bool> running{false};        ///< between start and stop
  std::atomic<bool> balancing{false};      ///< the state feedback acts
};

/// Set by a signal handler to the signal's number, otherwise 0. The stop button of the live page sets
/// `stop_button_pressed`.
using SignalFlag = std::atomic<int>;
inline constexpr int stop_button_pressed = -1;  ///< the value of a SignalFlag that is no signal

/// Callbacks during a stop. Each may be empty.
struct StopWatcher {
  /// Number of requests so far to end the waiting (Ctrl-C). One more request ends it.
  std::function<unsigned()> end_requests;
  /// Called about once per second while zero volts is not confirmed, with the remaining time.
  std::function<void(const StopReport&, double left_s)> trying;
};

}  // namespace upright
