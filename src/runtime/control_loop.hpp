// The fixed-rate loop: read, compute, write at once, log, sleep. One function for every rig, real or
// simulated. It follows the computer's clock, or that of a rig whose device is the clock.
#pragma once

#include <cstdint>

#include "control/encoder_watch.hpp"
#include "device_clock.hpp"
#include "record/run_log.hpp"
#include "sleep_policy.hpp"
#include "upright/control/controller.hpp"
#include "upright/hal/calibration.hpp"
#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/record/loop_outcome.hpp"
#include "upright/runtime/live_status.hpp"

namespace upright {

/// Runs for the given number of periods or until a safety stop. The rig must be open. On return its stop
/// has begun (`LoopOutcome::stop`); the caller waits for its completion. The last row of a safety stop
/// has zero volts. From the first cycle on it does not allocate, lock or throw, except that in virtual
/// time it waits for the log.
class ControlLoop {
 public:
  /// Keeps references to all arguments: eight parts that no other function needs together.
  ControlLoop(Rig& rig, Clock& clock, Controller& controller, PoseScaler& scaler, RowSink& log,
              const LoopLimits& limits, const SignalFlag& signal, LiveStatus& live);

  /// `outcome` is updated while the loop runs.
  void run(LoopOutcome& outcome) noexcept;

 private:
  void stop(LoopOutcome& outcome, StopReason reason, std::uint64_t first_bad) noexcept;
  void stop_without_news(const Wake& wake, StopReason reason, std::uint64_t first_bad,
                         LoopOutcome& outcome) noexcept;
  /// Times at which the parts of a cycle ended, on the loop's clock.
  struct Stamps {
    std::int64_t read_ns, computed_ns, end_ns;
  };
  std::int64_t wait_for_cycle() noexcept;
  bool is_due(std::int64_t woke_ns, LoopOutcome& outcome) noexcept;
  Wake begin_cycle(std::int64_t woke_ns) noexcept;
  void begin_time(std::int64_t start_ns, LoopOutcome& outcome) noexcept;
  Stamps act(const Wake& wake, LoopOutcome& outcome) noexcept;
  bool asked_to_end(LoopOutcome& outcome) noexcept;
  void log_stop(std::int64_t woke_ns, LoopOutcome& outcome) noexcept;
  void run_cycle(const Wake& wake, std::int64_t woke_ns, LoopOutcome& outcome) noexcept;
  bool accept(const RigReading& reading, const Wake& wake, LoopOutcome& outcome) noexcept;
  void compute(const RigReading& reading, const Wake& wake, LoopOutcome& outcome) noexcept;
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
  std::int64_t start_ns_ = 0;  ///< time zero of the rows
  DeviceClock device_clock_;
  DeviceSample sample_;             ///< the latest of a device that is the clock
  std::uint64_t sample_taken_ = 0;  ///< the number of the latest that is known to the clock
  bool follows_device_ = false, sample_came_ = false;
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
