// The fixed-rate loop: read, compute, write at once, log, sleep. One function for every rig, real or
// simulated.
#pragma once

#include <atomic>
#include <cstdint>

#include "upright/control/controller.hpp"
#include "upright/control/encoder_watch.hpp"
#include "upright/hal/calibration.hpp"
#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/record/loop_outcome.hpp"
#include "upright/record/run_log.hpp"
#include "upright/runtime/sleep_policy.hpp"

namespace upright {

/// The latest of the loop, for whoever shows it. Written by the loop, read by others; each field for itself.
struct LiveStatus {
  std::atomic<double> time_s{0.0}, cart_m{0.0}, theta_rad{0.0}, voltage_v{0.0}, worst_late_us{0.0};
  std::atomic<bool> running{false};
  std::atomic<bool> balancing{false};  ///< the state feedback acts
};

/// Set by a signal handler: the signal's number, or 0. The live page's stop button sets
/// `stop_button_pressed`.
using SignalFlag = std::atomic<int>;
inline constexpr int stop_button_pressed = -1;

/// Runs until the periods are over or a safety stop. The rig is open; when this returns its stop has begun
/// (`LoopOutcome::stop`), and somebody else waits for it. The last row of a safety stop is at zero volts.
/// Neither allocates, locks nor throws from the first cycle on, except that in virtual time it waits for the
/// log.
class ControlLoop {
 public:
  ControlLoop(Rig& rig, Clock& clock, Controller& controller, PoseScaler& scaler, RowSink& log,
              const LoopLimits& limits, const SignalFlag& signal, LiveStatus& live);

  /// `outcome` is filled in while the loop runs.
  void run(LoopOutcome& outcome) noexcept;

 private:
  void stop(LoopOutcome& outcome, StopReason reason, std::uint64_t first_bad) noexcept;
  void stop_without_news(const Wake& wake, StopReason reason, std::uint64_t first_bad,
                         LoopOutcome& outcome) noexcept;
  /// When the parts of a cycle were done, on the loop's clock.
  struct Stamps {
    std::int64_t read_ns, computed_ns, end_ns;
  };
  Stamps act(const Wake& wake, LoopOutcome& outcome) noexcept;
  bool asked_to_end(LoopOutcome& outcome) noexcept;
  void log_stop(std::int64_t woke_ns, LoopOutcome& outcome) noexcept;
  void run_cycle(const Wake& wake, std::int64_t woke_ns, LoopOutcome& outcome) noexcept;
  bool accept(const RigReading& reading, const Wake& wake, LoopOutcome& outcome) noexcept;
  void compute(const Wake& wake, LoopOutcome& outcome) noexcept;
  bool beyond_track(const Demand& demand) noexcept;
  bool strays_on_return() noexcept;
  void watch_encoders(const Wake& wake, bool balancing, LoopOutcome& outcome) noexcept;
  void write(const Wake& wake, std::int64_t computed_ns, LoopOutcome& outcome) noexcept;
  void count_missed(const Wake& wake, LoopOutcome& outcome) noexcept;
  void attribute_overrun(const Wake& wake, std::int64_t end_ns, LoopOutcome& outcome) noexcept;
  void show(const LoopOutcome& outcome) noexcept;

  Rig& rig_;
  Clock& clock_;
  Controller& controller_;
  PoseScaler& scaler_;
  RowSink& log_;
  LoopLimits limits_;
  const SignalFlag& signal_;
  LiveStatus& live_;

  EncoderWatch watch_;
  LoopPhase phase_;
  LogRecord row_;  ///< the latest: a cycle without fresh counts repeats its pose and voltage
  std::int64_t watchdog_ns_ = 0, last_fresh_ns_ = 0, last_write_ns_ = 0, read_done_ns_ = 0;
  std::uint64_t first_held_tick_ = 0, first_unwritten_tick_ = 0, first_late_tick_ = 0, periods_late_ = 0;
  RigFault last_fault_ = RigFault::none;
  bool after_gap_ = false;       // periods were missed, and no fresh reading has come since
  double return_bound_m_ = 0.0;  ///< how far out the cart may be while it comes back
  bool returning_ = false;  ///< a script began homing, and the cart is not yet known to stay on the track
  bool held_ = false, unwritten_ = false, begun_ = false, stopped_ = false, over_ = false, scripted_ = false;
};

}  // namespace upright
