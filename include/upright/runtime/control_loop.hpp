// The fixed-rate loop: read, compute, write at once, log, sleep. One function for every rig, real or
// simulated.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "upright/control/controller.hpp"
#include "upright/control/encoder_watch.hpp"
#include "upright/hal/calibration.hpp"
#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/runtime/link_counts.hpp"
#include "upright/runtime/run_log.hpp"
#include "upright/runtime/sleep_policy.hpp"
#include "upright/runtime/timing_stats.hpp"

namespace upright {

/// Why a run ended. Everything but `duration` is a safety stop, which is latched: the loop does not go on.
enum class StopReason : std::uint8_t {
  duration,  ///< the asked-for time is over
  signal,
  stop_button,  ///< of the live page
  not_finite,
  stale_encoder,
  stuck_encoder,  ///< fresh counts that do not follow the motion
  link_lost,
  rig_fault,
  track_limit,
  fell,
  overrun,
  emergency_stop,
  log_failed,
  not_ready,  ///< an experiment did not come to where it starts
};

/// "duration", "signal", "not_finite", ...
const char* name_of(StopReason reason) noexcept;

struct LoopLimits {
  std::uint64_t periods = 0;    ///< rows of a complete run
  double track_limit_m = 0.0;   ///< stop where |x| reaches it
  double fall_angle_rad = 0.0;  ///< stop where |theta| reaches it
  /// Stop when there was no fresh reading, or no good write, for longer than this.
  double watchdog_s = 0.0;
  /// Stop when more periods than this in a row ended late or were missed.
  std::uint64_t most_periods_late = 0;
  /// A cart without voltage rolls on for so many seconds times its velocity.
  double coast_s = 0.0;
  EncoderAssumptions encoders = {};  ///< of the watch on the encoders
  // What is known beforehand and may be why it ends: for sentence_of.
  bool delay_exceeded = false;  ///< the plant does not bear the loop's delay, or its gains
  bool signs_unproven = false;  ///< a real rig whose signs nobody checked
};

/// The latest of the loop, for whoever shows it. Written by the loop, read by others; each field for itself.
struct LiveStatus {
  std::atomic<double> time_s{0.0}, cart_m{0.0}, theta_rad{0.0}, voltage_v{0.0}, worst_late_us{0.0};
  std::atomic<bool> running{false};
  std::atomic<bool> balancing{false};  ///< the state feedback acts
};

struct LoopCounts {
  std::uint64_t periods = 0;  ///< cycles that ran
  std::uint64_t fresh = 0, stale = 0, faults = 0;
  std::uint64_t missed = 0;  ///< periods that passed without a cycle
  std::uint64_t overruns_wake = 0, overruns_read = 0, overruns_compute = 0, overruns_write = 0;
  std::uint64_t saturated = 0, writes_failed = 0;
  std::uint64_t page_faults = 0;  ///< of the loop's thread, none with memory locked; the session counts them
  LinkCounts link;                ///< why readings were stale or faults
};

struct LoopOutcome {
  StopReason reason = StopReason::duration;
  RigFault fault = RigFault::none;          ///< behind a stop by the rig or the link
  int exception = 0;                        ///< behind that fault: the number the device answered with
  StuckEncoder stuck = StuckEncoder::none;  ///< behind a stop by a stuck encoder
  int signal = 0;
  bool realtime = false;             ///< the loop was granted SCHED_FIFO
  std::int64_t start_ns = 0;         ///< on the loop's clock: time zero of the samples
  std::uint64_t tick = 0;            ///< cycle in which the run ended
  std::uint64_t first_bad_tick = 0;  ///< of the trouble that ended it
  double time_s = 0.0;               ///< at the end
  double worst_theta_rad = 0.0;      ///< largest |theta|
  double worst_cart_m = 0.0;         ///< largest |x|
  double last_theta_rad = 0.0, last_cart_m = 0.0;
  StopReport stop;  ///< whether the motor is known to be at zero volts
  LoopCounts counts;
  DurationHistogram wake_late, read, compute, write, cycle;
};

/// One sentence: what ended the run with its first bad cycle, and then what to do.
std::string sentence_of(const LoopOutcome& outcome, const LoopLimits& limits);

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
  void write(const Wake& wake, LoopOutcome& outcome) noexcept;
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
