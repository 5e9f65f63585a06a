#include "control_loop.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>

#include "hal/modbus_exception.hpp"
#include "hal/voltage_freshness.hpp"

namespace upright {

namespace {

// A script whose cart begins beyond the track limit, or on its way there, brings it back.
constexpr double longest_return_s = 10.0;   // several times the way at the script's speed
constexpr double return_roll_s = 0.3;       // a braked cart rolls on for less than this times its velocity
constexpr double return_slack_m = 0.05;     // what a swinging pendulum moves the cart against the motor
constexpr double estimates_settle_s = 0.1;  // several time constants of a velocity filter

/// What a fault means for the loop: nothing yet while it is one of the link, which may pass within the
/// watchdog time.
StopReason reason_for(RigFault fault) {
  switch (fault) {
    case RigFault::emergency_stop:
      return StopReason::emergency_stop;
    case RigFault::limit_switch:
    case RigFault::limit_switch_plus:
    case RigFault::limit_switch_minus:
      return StopReason::track_limit;
    case RigFault::not_finite:
      return StopReason::not_finite;
    case RigFault::device_restarted:
    case RigFault::counts_jumped:
    case RigFault::device_refused:
    case RigFault::output_kept:
    case RigFault::line_failed:
    case RigFault::edges_lost:
    case RigFault::edges_too_fast:
    case RigFault::watchdog_expired:
      return StopReason::rig_fault;
    case RigFault::link_timeout:
    case RigFault::link_lost:
    case RigFault::corrupt_reply:
    case RigFault::device_busy:
    case RigFault::out_of_range:
    case RigFault::none:
      break;
  }
  return StopReason::link_lost;
}

bool may_pass(RigFault fault) {
  return reason_for(fault) == StopReason::link_lost;
}

}  // namespace

ControlLoop::ControlLoop(Rig& rig, Clock& clock, Controller& controller, PoseScaler& scaler, RowSink& log,
                         const LoopLimits& limits, const SignalFlag& signal, LiveStatus& live)
    : rig_(rig),
      clock_(clock),
      controller_(controller),
      scaler_(scaler),
      log_(log),
      limits_(limits),
      signal_(signal),
      live_(live),
      watch_(limits.encoders, scaler.calibration().cart.per_count, scaler.calibration().pendulum.per_count) {}

void ControlLoop::stop(LoopOutcome& outcome, StopReason reason, std::uint64_t first_bad) noexcept {
  rig_.stop();
  outcome.reason = reason;
  outcome.fault = last_fault_;
  const bool by_exception = last_fault_ == RigFault::device_refused || last_fault_ == RigFault::device_busy;
  outcome.exception = by_exception ? rig_.last_exception() : 0;
  outcome.first_bad_tick = first_bad;
  stopped_ = true;
}

/// Nothing was read or written for longer than the watchdog's time. Where this cycle itself has taken more
/// periods than may be late, it was held up here, and neither link nor encoders are to blame.
void ControlLoop::stop_without_news(const Wake& wake, StopReason reason, std::uint64_t first_bad,
                                    LoopOutcome& outcome) noexcept {
  const std::int64_t taken_ns = std::max<std::int64_t>(0, read_done_ns_ - phase_.due_ns(wake.tick));
  if (static_cast<std::uint64_t>(taken_ns / phase_.period_ns) > limits_.max_periods_late)
    stop(outcome, StopReason::overrun, wake.tick);
  else
    stop(outcome, reason, first_bad);
}

/// Takes the counts of a reading, or notes that there are none to take. True: there is a pose to compute
/// with.
bool ControlLoop::accept(const RigReading& reading, const Wake& wake, LoopOutcome& outcome) noexcept {
  outcome.counts.link.add(reading);
  if (reading.status == RigStatus::fresh) {
    ++outcome.counts.fresh;
    row_.cart_counts = reading.cart_counts;
    row_.pendulum_counts = reading.pendulum_counts;
    row_.sequence = reading.sequence;
    row_.time_ns = reading.time_ns - start_ns_;
    last_fresh_ns_ = reading.time_ns;
    held_ = after_gap_ = false;
    return true;
  }
  if (!held_) first_held_tick_ = wake.tick;
  held_ = true;
  const bool fault = reading.status == RigStatus::fault;
  ++(fault ? outcome.counts.faults : outcome.counts.stale);
  row_.flags |= fault ? row_flag::fault : row_flag::stale;
  if (fault) last_fault_ = reading.fault;
  if (fault && !may_pass(reading.fault)) {
    stop(outcome, reason_for(reading.fault), wake.tick);
  } else if (read_done_ns_ - last_fresh_ns_ > watchdog_ns_) {
    stop_without_news(wake, fault ? StopReason::link_lost : StopReason::stale_encoder, first_held_tick_,
                      outcome);
  }
  return false;
}

void ControlLoop::compute(const RigReading& reading, const Wake& wake, LoopOutcome& outcome) noexcept {
  Pose pose = scaler_.scale(row_.cart_counts, row_.pendulum_counts);
  if (!begun_) {
    pose = scaler_.nearest_turn();
    returning_ = scripted_;
  }
  begun_ = true;
  const ControlOutput output = controller_.step({wake.tick, pose.cart_m, pose.theta_rad, 0.0,
                                                 scaler_.cart_velocity_mps(reading.cart_counts_per_s),
                                                 scaler_.pendulum_rate_radps(reading.pendulum_counts_per_s)});
  row_.cart_m = pose.cart_m;
  row_.theta_rad = pose.theta_rad;
  row_.cart_velocity_mps = output.state.cart_velocity_mps;
  row_.pendulum_rate_radps = output.state.pendulum_rate_radps;
  row_.voltage_requested_v = output.voltage_requested_v;
  row_.voltage_v = output.voltage_v;
  if (output.saturated) {
    row_.flags |= row_flag::saturated;
    ++outcome.counts.saturated;
  }
  outcome.last_theta_rad = pose.theta_rad;
  outcome.last_cart_m = pose.cart_m;
  const bool balancing = output.demand.feedback;
  if (balancing) outcome.worst_theta_rad = std::max(outcome.worst_theta_rad, std::abs(output.lean_rad));
  outcome.worst_cart_m = std::max(outcome.worst_cart_m, std::abs(pose.cart_m));
  if (!output.finite)
    stop(outcome, StopReason::not_finite, wake.tick);
  else if (balancing && std::abs(output.lean_rad) >= limits_.fall_angle_rad)
    stop(outcome, StopReason::fell, wake.tick);
  else if (beyond_track(output.demand))
    stop(outcome, StopReason::track_limit, wake.tick);
  else if (output.demand.timed_out)
    stop(outcome, StopReason::not_ready, wake.tick);
  if (!stopped_) watch_encoders(wake, balancing, outcome);
  over_ = output.demand.over;
  if (scripted_ && balancing) row_.flags |= row_flag::feedback;
  live_.balancing.store(balancing, std::memory_order_relaxed);
}

/// At the track limit; or, while it balances, where a cart without voltage would roll to it. A script's
/// voltages are planned to end within the track. A script may begin beyond the limit, or rolling there,
/// where the run before left the cart: it is given the time to bring it back.
bool ControlLoop::beyond_track(const Demand& demand) noexcept {
  returning_ = returning_ && demand.homing;
  if (returning_) return strays_on_return();
  const double outward_mps = std::copysign(1.0, row_.cart_m) * row_.cart_velocity_mps;
  const double rolls_m = demand.feedback ? limits_.coast_s * std::max(0.0, outward_mps) : 0.0;
  return std::abs(row_.cart_m) + rolls_m >= limits_.track_limit_m;
}

/// True where the cart, on its way back into the track, goes farther out than it rolls by itself, or takes
/// too long.
bool ControlLoop::strays_on_return() noexcept {
  const double time_s = static_cast<double>(row_.time_ns) * 1e-9;
  const double out_m = std::abs(row_.cart_m);
  const double rolls_m =
      return_roll_s * std::max(0.0, std::copysign(1.0, row_.cart_m) * row_.cart_velocity_mps);
  const double reaches_m = std::max(out_m + rolls_m + return_slack_m, limits_.track_limit_m);
  if (time_s <= estimates_settle_s) {
    // The velocity estimates begin at rest: until they have settled the bound follows the cart.
    return_bound_m_ = std::max(return_bound_m_, reaches_m);
    return false;
  }
  return_bound_m_ = std::min(return_bound_m_, reaches_m);
  if (out_m + rolls_m < limits_.track_limit_m) returning_ = false;
  return out_m > return_bound_m_ || (out_m >= limits_.track_limit_m && time_s > longest_return_s);
}

void ControlLoop::watch_encoders(const Wake& wake, bool balancing, LoopOutcome& outcome) noexcept {
  if (!balancing) {
    watch_.reset();
    return;
  }
  outcome.stuck = watch_.step({wake.tick, static_cast<double>(row_.time_ns) * 1e-9, row_.cart_counts,
                               row_.pendulum_counts, row_.cart_m, row_.voltage_v});
  if (outcome.stuck != StuckEncoder::none)
    stop(outcome, StopReason::stuck_encoder, watch_.silent_since(outcome.stuck));
}

void ControlLoop::write(const Wake& wake, std::int64_t computed_ns, LoopOutcome& outcome) noexcept {
  // A voltage from before a gap, or from a cycle that stood still before it could write, is not sent: it was
  // meant for a pose that has passed.
  const bool is_old = after_gap_ || computed_ns > phase_.due_ns(wake.tick + freshness_periods);
  const RigFault fault = is_old ? RigFault::link_timeout : rig_.write(row_.voltage_v);
  if (fault == RigFault::none) {
    last_write_ns_ = read_done_ns_;
    unwritten_ = false;
    return;
  }
  if (!unwritten_) first_unwritten_tick_ = wake.tick;
  unwritten_ = true;
  last_fault_ = fault;
  row_.flags |= row_flag::write_failed;
  ++outcome.counts.writes_failed;
  if (!may_pass(fault))
    stop(outcome, reason_for(fault), wake.tick);
  else if (read_done_ns_ - last_write_ns_ > watchdog_ns_)
    stop_without_news(wake, StopReason::link_lost, first_unwritten_tick_, outcome);
}

/// Counts the periods that passed without a cycle. Too many of them stop the motor here, before this cycle
/// gives it another voltage.
void ControlLoop::count_missed(const Wake& wake, LoopOutcome& outcome) noexcept {
  if (wake.missed == 0) return;
  if (periods_late_ == 0) first_late_tick_ = wake.tick - wake.missed;
  periods_late_ += wake.missed;
  row_.flags |= row_flag::missed;
  after_gap_ = true;
  outcome.counts.missed += wake.missed;
  if (periods_late_ > limits_.max_periods_late && !stopped_)
    stop(outcome, StopReason::overrun, first_late_tick_);
}

/// Counts a cycle that ended after the next was due, on the part that took longest.
void ControlLoop::attribute_overrun(const Wake& wake, std::int64_t end_ns, LoopOutcome& outcome) noexcept {
  if (end_ns <= phase_.due_ns(wake.tick + 1)) {
    periods_late_ = 0;
    return;
  }
  if (periods_late_ == 0) first_late_tick_ = wake.tick;
  ++periods_late_;
  LoopCounts& counts = outcome.counts;
  const std::int64_t longest = std::max({row_.wake_late_ns, row_.read_ns, row_.compute_ns, row_.write_ns});
  if (longest == row_.read_ns) {
    row_.flags |= row_flag::overrun_read;
    ++counts.overruns_read;
  } else if (longest == row_.compute_ns) {
    row_.flags |= row_flag::overrun_compute;
    ++counts.overruns_compute;
  } else if (longest == row_.write_ns) {
    row_.flags |= row_flag::overrun_write;
    ++counts.overruns_write;
  } else {
    row_.flags |= row_flag::overrun_wake;
    ++counts.overruns_wake;
  }
  if (periods_late_ > limits_.max_periods_late && !stopped_)
    stop(outcome, StopReason::overrun, first_late_tick_);
}

/// Reads, computes and writes; returns when each was done.
ControlLoop::Stamps ControlLoop::act(const Wake& wake, LoopOutcome& outcome) noexcept {
  const RigReading reading = rig_.read();
  read_done_ns_ = clock_.now_ns();
  const bool computed = accept(reading, wake, outcome);
  if (computed) compute(reading, wake, outcome);
  const std::int64_t computed_ns = clock_.now_ns();
  if (!stopped_) write(wake, computed_ns, outcome);
  return {read_done_ns_, computed_ns, clock_.now_ns()};
}

void ControlLoop::run_cycle(const Wake& wake, std::int64_t woke_ns, LoopOutcome& outcome) noexcept {
  row_.tick = wake.tick;
  row_.time_ns = woke_ns - start_ns_;
  row_.flags = 0;
  row_.wake_late_ns = wake.late_ns;
  Stamps done{woke_ns, woke_ns, woke_ns};
  count_missed(wake, outcome);
  if (stopped_) {
    row_.flags |= row_flag::stale;
    ++outcome.counts.stale;
  } else {
    done = act(wake, outcome);
  }
  row_.read_ns = done.read_ns - woke_ns;
  row_.compute_ns = done.computed_ns - done.read_ns;
  row_.write_ns = done.end_ns - done.computed_ns;
  attribute_overrun(wake, done.end_ns, outcome);
  if (stopped_) {
    row_.flags |= row_flag::stopped;
    row_.voltage_v = 0.0;
  }
  ++outcome.counts.periods;
  outcome.wake_late.add(row_.wake_late_ns);
  outcome.read.add(row_.read_ns);
  outcome.compute.add(row_.compute_ns);
  outcome.write.add(row_.write_ns);
  outcome.cycle.add(done.end_ns - woke_ns);
  // A log that has failed is not waited for.
  if (clock_.is_virtual() && !log_.failed())
    log_.push_waiting(row_);
  else
    log_.push(row_);
}

void ControlLoop::show(const LoopOutcome& outcome) noexcept {
  constexpr auto relaxed = std::memory_order_relaxed;
  live_.time_s.store(outcome.time_s, relaxed);
  live_.cart_m.store(row_.cart_m, relaxed);
  live_.theta_rad.store(row_.theta_rad, relaxed);
  live_.voltage_v.store(row_.voltage_v, relaxed);
  live_.worst_late_us.store(outcome.wake_late.max_us(), relaxed);
}

/// Somebody, or the log, ends the run before this period's cycle.
bool ControlLoop::asked_to_end(LoopOutcome& outcome) noexcept {
  if (const int signal = signal_.load(std::memory_order_relaxed); signal != 0) {
    const bool button = signal == stop_button_pressed;
    stop(outcome, button ? StopReason::stop_button : StopReason::signal, phase_.next_tick);
    if (!button) outcome.signal = signal;
    return true;
  }
  if (!log_.failed()) return false;
  stop(outcome, StopReason::log_failed, phase_.next_tick);
  return true;
}

/// The row of a stop that came between two cycles: nothing was read, and the motor is at zero volts.
void ControlLoop::log_stop(std::int64_t woke_ns, LoopOutcome& outcome) noexcept {
  // Woken by the signal itself, the period may not be due yet.
  const Wake wake = wake_at(phase_, std::max(woke_ns, phase_.due_ns(phase_.next_tick)));
  run_cycle(wake, woke_ns, outcome);
}

/// Time zero of the rows.
void ControlLoop::begin_time(std::int64_t start_ns, LoopOutcome& outcome) noexcept {
  start_ns_ = outcome.start_ns = start_ns;
  last_fresh_ns_ = last_write_ns_ = start_ns;
}

/// Until the next cycle is due, or somebody sent a signal. A device that is the clock is waited for with a
/// bound: without a sample the cycle begins late, and its reading is one that did not come.
std::int64_t ControlLoop::wait_for_cycle() noexcept {
  if (!follows_device_)
    return wait_until_due(clock_, phase_.due_ns(phase_.next_tick), clock_.is_virtual() ? 0 : limits_.spin_ns,
                          [&] { return signal_.load(std::memory_order_relaxed) != 0; });
  const std::int64_t until_ns = DeviceClock::patience_ends_ns(phase_);
  sample_ = rig_.wait_next(until_ns);
  // A device that has ended sampling is not asked again and again.
  if (sample_.number == sample_taken_) clock_.sleep_until(until_ns);
  return clock_.now_ns();
}

/// False: woken by a signal meant for someone else, or by the sample of a cycle that has run without it.
bool ControlLoop::is_due(std::int64_t woke_ns, LoopOutcome& outcome) noexcept {
  if (!follows_device_) return woke_ns >= phase_.due_ns(phase_.next_tick);
  sample_came_ = sample_.number != sample_taken_;
  if (!sample_came_) return woke_ns >= DeviceClock::patience_ends_ns(phase_);
  sample_taken_ = sample_.number;
  const bool is_of_next = device_clock_.take(sample_, phase_);
  if (outcome.counts.periods == 0) begin_time(sample_.time_ns, outcome);
  return is_of_next;
}

Wake ControlLoop::begin_cycle(std::int64_t woke_ns) noexcept {
  return sample_came_ ? device_clock_.wake(phase_, woke_ns) : wake_at(phase_, woke_ns);
}

void ControlLoop::run(LoopOutcome& outcome) noexcept {
  outcome = {};
  follows_device_ = rig_.is_clock();
  // The first cycle is due a little ahead, so that it is not late before it began, and a device's first
  // sample has time to come.
  constexpr std::int64_t lead_periods = 4;
  const bool needs_lead = !clock_.is_virtual() || follows_device_;
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 * controller_.config().period_s()));
  phase_ = {clock_.now_ns() + (needs_lead ? lead_periods * period_ns : 0), period_ns, 0};
  begin_time(phase_.start_ns, outcome);
  watchdog_ns_ = static_cast<std::int64_t>(std::llround(limits_.watchdog_s * 1e9));
  live_.running.store(true, std::memory_order_relaxed);
  scripted_ = controller_.is_scripted();
  // A sample from before the run begins no cycle.
  if (follows_device_) sample_taken_ = rig_.wait_next(clock_.now_ns()).number;
  while (!stopped_ && !over_) {
    const std::int64_t woke_ns = wait_for_cycle();
    if (asked_to_end(outcome)) {
      log_stop(woke_ns, outcome);
      break;
    }
    if (!is_due(woke_ns, outcome)) continue;
    if (phase_.next_tick >= limits_.periods) break;
    const Wake wake = begin_cycle(woke_ns);
    outcome.time_s = static_cast<double>(woke_ns - start_ns_) / 1e9;
    run_cycle(wake, woke_ns, outcome);
    show(outcome);
  }
  outcome.stop = rig_.stop();
  row_.voltage_v = 0.0;
  outcome.time_s = static_cast<double>(clock_.now_ns() - start_ns_) / 1e9;
  if (follows_device_) outcome.device_clock = device_clock_.timing(phase_.period_ns);
  show(outcome);
  live_.running.store(false, std::memory_order_relaxed);
}

}  // namespace upright
