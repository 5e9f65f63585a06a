#include "upright/runtime/control_loop.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace upright {

const char* name_of(StopReason reason) noexcept {
  switch (reason) {
    case StopReason::duration:
      return "duration";
    case StopReason::signal:
      return "signal";
    case StopReason::stop_button:
      return "stop_button";
    case StopReason::not_finite:
      return "not_finite";
    case StopReason::stale_encoder:
      return "stale_encoder";
    case StopReason::stuck_encoder:
      return "stuck_encoder";
    case StopReason::link_lost:
      return "link_lost";
    case StopReason::rig_fault:
      return "rig_fault";
    case StopReason::track_limit:
      return "track_limit";
    case StopReason::fell:
      return "fell";
    case StopReason::overrun:
      return "overrun";
    case StopReason::emergency_stop:
      return "emergency_stop";
    case StopReason::log_failed:
      return "log_failed";
    case StopReason::not_ready:
      return "not_ready";
  }
  return "unknown";
}

namespace {

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
    case RigFault::line_failed:
    case RigFault::edges_lost:
    case RigFault::edges_too_fast:
      return StopReason::rig_fault;
    case RigFault::link_timeout:
    case RigFault::link_lost:
    case RigFault::corrupt_reply:
    case RigFault::out_of_range:
    case RigFault::none:
      break;
  }
  return StopReason::link_lost;
}

bool may_pass(RigFault fault) {
  return reason_for(fault) == StopReason::link_lost;
}

const char* words_for(RigFault fault) {
  switch (fault) {
    case RigFault::none:
      return "no fault reported";
    case RigFault::link_timeout:
      return "no reply in time";
    case RigFault::link_lost:
      return "the connection is gone";
    case RigFault::corrupt_reply:
      return "corrupt replies";
    case RigFault::device_restarted:
      return "the device restarted, its counts begin anew";
    case RigFault::counts_jumped:
      return "the counts jumped by more than any motion explains";
    case RigFault::device_refused:
      return "the device refused the request";
    case RigFault::not_finite:
      return "a voltage that is not a number";
    case RigFault::out_of_range:
      return "counts the hardware cannot mean";
    case RigFault::emergency_stop:
      return "emergency stop";
    case RigFault::limit_switch:
      return "a limit switch was hit";
    case RigFault::limit_switch_plus:
      return "the limit switch at the +x end was hit";
    case RigFault::limit_switch_minus:
      return "the limit switch at the -x end was hit";
    case RigFault::line_failed:
      return "a digital line could not be read or set";
    case RigFault::edges_lost:
      return "edges of an encoder were lost, its counts are wrong";
    case RigFault::edges_too_fast:
      return "an encoder's edges came faster than fastest_edges_per_s, some may be lost";
  }
  return "unknown fault";
}

/// What to do about a fault of the rig, before anything else.
const char* remedy_for(RigFault fault) {
  switch (fault) {
    case RigFault::line_failed:
      return "check the GPIO chip and its driver";
    case RigFault::edges_lost:
      return "check the encoder's wiring and that nothing delays the kernel's interrupts, then take the zero "
             "again";
    case RigFault::edges_too_fast:
      return "let the encoder turn more slowly or use a hardware counter, then take the zero again";
    default:
      return "reset the device and start again";
  }
}

/// A run that ends as soon as it began has most often a sign wrong.
std::string first_check(double time_s) {
  constexpr double soon_s = 1.5;
  return time_s < soon_s ? "check the signs of encoders and amplifier with the motor off, then " : "";
}

std::string went_on_after(const LinkCounts& link) {
  const std::string troubles = sentence_of(link);
  return troubles.empty() ? "" : " and went on after " + troubles;
}

std::string brief(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace

std::string sentence_of(const LoopOutcome& o, const LoopLimits& limits) {
  const std::string when = " in cycle " + std::to_string(o.first_bad_tick) + " (" + brief(o.time_s) + " s)";
  const double degrees = 180.0 / std::numbers::pi;
  switch (o.reason) {
    case StopReason::duration:
      return "the run lasted its whole time" + went_on_after(o.counts.link);
    case StopReason::signal:
      return std::string("start again when ready: stopped by ") +
             (o.signal == 2    ? "SIGINT"
              : o.signal == 15 ? "SIGTERM"
                               : "signal " + std::to_string(o.signal)) +
             when;
    case StopReason::stop_button:
      return "start again when ready: stopped from the live page" + when;
    case StopReason::not_finite:
      return "check the gains and the sensors: a value was not a finite number" + when;
    case StopReason::stale_encoder:
      return "check the encoders' link: no new counts for more than the watchdog's " +
             brief(limits.watchdog_s * 1e3) + " ms, first" + when;
    case StopReason::stuck_encoder:
      return std::string("check the ") + (o.stuck == StuckEncoder::cart ? "cart's" : "pendulum's") +
             " encoder and its cable, and that the amplifier is on and the cart free: it does not count "
             "although the motor is balancing, first" +
             when;
    case StopReason::link_lost:
      return "check cable, address and device: the link failed for more than the watchdog's " +
             brief(limits.watchdog_s * 1e3) + " ms (" + words_for(o.fault) + "), first" + when;
    case StopReason::rig_fault:
      return std::string(remedy_for(o.fault)) + ": " + words_for(o.fault) + when;
    case StopReason::track_limit:
      return is_limit_switch(o.fault)
                 ? std::string("bring the cart back to the middle: ") + words_for(o.fault) + when
                 : first_check(o.time_s) +
                       "bring the cart back to the middle: it reached the track limit of " +
                       brief(limits.track_limit_m) +
                       " m, or rolled towards it, at x = " + brief(o.last_cart_m) + " m" + when;
    case StopReason::fell:
      return first_check(o.time_s) + "lift the pendulum again: it fell, |theta| reached the limit of " +
             brief(limits.fall_angle_rad * degrees) + " degrees" + when;
    case StopReason::overrun:
      return "free the processor, grant real-time scheduling or lower the sample rate: more than " +
             std::to_string(limits.most_periods_late) + " periods in a row were late, first" + when;
    case StopReason::emergency_stop:
      return "release the emergency stop when it is safe: it was pressed" + when;
    case StopReason::log_failed:
      return "free space, or use a faster disk, where the run directory goes: the log could not keep every "
             "row" +
             when;
    case StopReason::not_ready:
      return "bring the rig to where the experiment starts (at rest, or held upright as it says): it waited "
             "in vain" +
             when;
  }
  return "unknown reason";
}

ControlLoop::ControlLoop(Rig& rig, Clock& clock, Controller& controller, PoseScaler& scaler, RowSink& log,
                         const LoopLimits& limits, const SignalFlag& signal, LiveStatus& live)
    : rig_(rig),
      clock_(clock),
      controller_(controller),
      scaler_(scaler),
      log_(log),
      limits_(limits),
      signal_(signal),
      live_(live) {}

void ControlLoop::stop(LoopOutcome& outcome, StopReason reason, std::uint64_t first_bad) noexcept {
  rig_.stop();
  outcome.reason = reason;
  outcome.fault = last_fault_;
  outcome.first_bad_tick = first_bad;
  stopped_ = true;
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
    row_.time_ns = reading.time_ns - phase_.start_ns;
    last_fresh_ns_ = reading.time_ns;
    held_ = false;
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
    stop(outcome, fault ? StopReason::link_lost : StopReason::stale_encoder, first_held_tick_);
  }
  return false;
}

void ControlLoop::compute(const Wake& wake, LoopOutcome& outcome) noexcept {
  Pose pose = scaler_.scale(row_.cart_counts, row_.pendulum_counts);
  if (!begun_) pose = scaler_.nearest_turn();
  begun_ = true;
  const ControlOutput output = controller_.step({wake.tick, pose.cart_m, pose.theta_rad, 0.0});
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
  else if (beyond_track(balancing))
    stop(outcome, StopReason::track_limit, wake.tick);
  else if (output.demand.gave_up)
    stop(outcome, StopReason::not_ready, wake.tick);
  if (!stopped_) watch_encoders(wake, balancing, outcome);
  over_ = output.demand.over;
  if (scripted_ && balancing) row_.flags |= row_flag::feedback;
  live_.balancing.store(balancing, std::memory_order_relaxed);
}

/// At the track limit; or, while it balances, where a cart without voltage would roll to it. A script's
/// voltages are planned to end within the track.
bool ControlLoop::beyond_track(bool balancing) const noexcept {
  const double outward_mps = std::copysign(1.0, row_.cart_m) * row_.cart_velocity_mps;
  const double rolls_m = balancing ? limits_.coast_s * std::max(0.0, outward_mps) : 0.0;
  return std::abs(row_.cart_m) + rolls_m >= limits_.track_limit_m;
}

void ControlLoop::watch_encoders(const Wake& wake, bool balancing, LoopOutcome& outcome) noexcept {
  if (!balancing) {
    watch_.reset();
    return;
  }
  outcome.stuck = watch_.step({wake.tick, static_cast<double>(row_.time_ns) * 1e-9, row_.cart_counts,
                               row_.pendulum_counts, row_.cart_velocity_mps, row_.voltage_v});
  if (outcome.stuck != StuckEncoder::none)
    stop(outcome, StopReason::stuck_encoder, watch_.silent_since(outcome.stuck));
}

void ControlLoop::write(const Wake& wake, LoopOutcome& outcome) noexcept {
  const RigFault fault = rig_.write(row_.voltage_v);
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
    stop(outcome, StopReason::link_lost, first_unwritten_tick_);
}

/// Counts the periods that passed without a cycle. Too many of them stop the motor here, before this cycle
/// gives it another voltage.
void ControlLoop::count_missed(const Wake& wake, LoopOutcome& outcome) noexcept {
  if (wake.missed == 0) return;
  if (periods_late_ == 0) first_late_tick_ = wake.tick - wake.missed;
  periods_late_ += wake.missed;
  row_.flags |= row_flag::missed;
  outcome.counts.missed += wake.missed;
  if (periods_late_ > limits_.most_periods_late) stop(outcome, StopReason::overrun, first_late_tick_);
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
  if (periods_late_ > limits_.most_periods_late && !stopped_)
    stop(outcome, StopReason::overrun, first_late_tick_);
}

/// Reads, computes and writes; returns when each was done.
ControlLoop::Stamps ControlLoop::act(const Wake& wake, LoopOutcome& outcome) noexcept {
  const RigReading reading = rig_.read();
  read_done_ns_ = clock_.now_ns();
  const bool computed = accept(reading, wake, outcome);
  if (computed) compute(wake, outcome);
  const std::int64_t computed_ns = clock_.now_ns();
  if (!stopped_) write(wake, outcome);
  return {read_done_ns_, computed_ns, clock_.now_ns()};
}

void ControlLoop::run_cycle(const Wake& wake, std::int64_t woke_ns, LoopOutcome& outcome) noexcept {
  row_.tick = wake.tick;
  row_.time_ns = woke_ns - phase_.start_ns;
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
  if (clock_.is_virtual())
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

void ControlLoop::run(LoopOutcome& outcome) noexcept {
  outcome = {};
  // The first cycle is due a little ahead, so that it is not late before it began.
  constexpr std::int64_t lead_periods = 4;
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 * controller_.config().period_s()));
  phase_ = {clock_.now_ns() + (clock_.is_virtual() ? 0 : lead_periods * period_ns), period_ns, 0};
  outcome.start_ns = phase_.start_ns;
  watchdog_ns_ = static_cast<std::int64_t>(std::llround(limits_.watchdog_s * 1e9));
  last_fresh_ns_ = last_write_ns_ = phase_.start_ns;
  live_.running.store(true, std::memory_order_relaxed);
  scripted_ = controller_.is_scripted();
  while (!stopped_ && !over_) {
    clock_.sleep_until(phase_.due_ns(phase_.next_tick));
    const std::int64_t woke_ns = clock_.now_ns();
    if (const int signal = signal_.load(std::memory_order_relaxed); signal != 0) {
      const bool button = signal == stop_button_pressed;
      stop(outcome, button ? StopReason::stop_button : StopReason::signal, phase_.next_tick);
      if (!button) outcome.signal = signal;
      break;
    }
    if (log_.failed()) {
      stop(outcome, StopReason::log_failed, phase_.next_tick);
      break;
    }
    // Woken by a signal meant for someone else.
    if (woke_ns < phase_.due_ns(phase_.next_tick)) continue;
    if (phase_.next_tick >= limits_.periods) break;
    const Wake wake = wake_at(phase_, woke_ns);
    outcome.time_s = static_cast<double>(woke_ns - phase_.start_ns) / 1e9;
    run_cycle(wake, woke_ns, outcome);
    show(outcome);
  }
  rig_.stop();
  outcome.time_s = static_cast<double>(clock_.now_ns() - phase_.start_ns) / 1e9;
  show(outcome);
  live_.running.store(false, std::memory_order_relaxed);
}

}  // namespace upright
