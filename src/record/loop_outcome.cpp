#include "upright/record/loop_outcome.hpp"

#include <csignal>
#include <cstdio>
#include <numbers>

#include "hal/modbus_exception.hpp"

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

const char* words_for(RigFault fault) {
  switch (fault) {
    case RigFault::none:
      return "no fault reported";
    case RigFault::link_timeout:
      return "no reply in time";
    case RigFault::link_lost:
      return "the connection was lost";
    case RigFault::corrupt_reply:
      return "corrupt replies";
    case RigFault::device_restarted:
      return "the device restarted, so its counters were reset";
    case RigFault::counts_jumped:
      return "the encoder counts jumped farther than fastest_mps or fastest_radps allows";
    case RigFault::device_refused:
      return "the device refused the request";
    case RigFault::device_busy:
      return "the device answered that it is busy";
    case RigFault::output_kept:
      return "the device acknowledged zero volts but kept its voltage";
    case RigFault::not_finite:
      return "the voltage was not a finite number";
    case RigFault::out_of_range:
      return "an encoder reading was outside its valid range";
    case RigFault::emergency_stop:
      return "the emergency stop was pressed";
    case RigFault::limit_switch:
      return "a limit switch was hit";
    case RigFault::limit_switch_plus:
      return "the limit switch at the +x end was hit";
    case RigFault::limit_switch_minus:
      return "the limit switch at the -x end was hit";
    case RigFault::line_failed:
      return "a digital line could not be read or set";
    case RigFault::edges_lost:
      return "encoder edges were lost, so the counts are wrong";
    case RigFault::edges_too_fast:
      return "encoder edges came faster than fastest_edges_per_s, so some may be lost";
    case RigFault::watchdog_expired:
      return "the device's own watchdog expired and switched the voltage off";
  }
  return "unknown fault";
}

/// The same with the exception that the device answered with.
std::string words_for(const LoopOutcome& o) {
  if (o.exception == 0) return words_for(o.fault);
  if (o.fault == RigFault::device_refused)
    return "the device refused the request with " + exception_text(o.exception);
  if (o.fault == RigFault::device_busy) return "the device answered with " + exception_text(o.exception);
  return words_for(o.fault);
}

const char* name_of_signal(int number) {
  switch (number) {
    case SIGHUP:
      return "SIGHUP";
    case SIGINT:
      return "SIGINT";
    case SIGQUIT:
      return "SIGQUIT";
    case SIGTERM:
      return "SIGTERM";
    case SIGTSTP:
      return "SIGTSTP";
    default:
      return "a signal";
  }
}

/// What to do about a fault of the rig.
const char* remedy_for(RigFault fault) {
  switch (fault) {
    case RigFault::line_failed:
      return "check the GPIO chip and its driver";
    case RigFault::edges_lost:
      return "check the encoder's wiring and what delays the interrupts, then start again to set a new zero";
    case RigFault::edges_too_fast:
      return "turn the encoder more slowly or use a hardware counter, then start again to set a new zero";
    case RigFault::watchdog_expired:
      return "start again, which unlocks the device; if it happens again, reduce the load on this computer "
             "or lengthen the device's watchdog time";
    default:
      return "reset the device and start again";
  }
}

std::string went_on_after(const LinkCounts& link) {
  const std::string troubles = sentence_of(link);
  return troubles.empty() ? "" : " despite " + troubles;
}

std::string brief(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// The likely cause of a fall or of a cart at the end of the track, and the remedy.
std::string why_not_held(const LoopOutcome& o, const LoopLimits& limits) {
  constexpr double soon_s = 1.5;  // a wrong sign ends a run within this time
  if (limits.delay_exceeded)
    return "; the gains do not stabilize this plant with this delay: see upright margin";
  if (limits.signs_unproven && o.time_s < soon_s)
    return " soon after the start, and the signs of this rig were not checked: switch the motor off, check "
           "the signs of the encoders and the amplifier, then lift the pendulum again";
  return ": look in the report for a push, voltage saturation or late periods before the stop";
}

std::string sentence_of_fall(const LoopOutcome& o, const LoopLimits& limits, const std::string& when) {
  const std::string limit = brief(limits.fall_angle_rad * 180.0 / std::numbers::pi) + " degrees";
  if (o.first_bad_tick == 0)
    return "the pendulum was already more than " + limit + " from upright at the start" + when +
           ": lift it upright and hold it still until the motor takes over";
  return "the pendulum fell past the limit of " + limit + when + why_not_held(o, limits);
}

std::string sentence_of_track(const LoopOutcome& o, const LoopLimits& limits, const std::string& when) {
  const std::string back = ": move the cart back to the middle";
  if (is_limit_switch(o.fault)) return std::string(words_for(o.fault)) + when + back;
  const std::string limit = "the track limit of " + brief(limits.track_limit_m) + " m";
  const std::string at = ", at x = " + brief(o.last_cart_m) + " m";
  if (o.first_bad_tick == 0) return "the cart was already at " + limit + at + ", at the start" + when + back;
  return "the cart reached " + limit + " or would have coasted to it" + at + when + why_not_held(o, limits);
}

/// The phase of the period with the most overruns decides cause and remedy.
std::string sentence_of_overrun(const LoopOutcome& o, const LoopLimits& limits, const std::string& when) {
  const LoopCounts& c = o.counts;
  const std::uint64_t link = c.overruns_read + c.overruns_write;
  std::string cause = "the processor was busy: ",
              remedy = "reduce its load (see upright doctor) or lower sample_rate_hz";
  if (link > c.overruns_wake + c.overruns_compute) {
    cause = "reading and writing the rig took too long: ";
    remedy = "check the link or lower sample_rate_hz";
  } else if (!o.realtime) {
    cause = "the loop woke late because it has no real-time scheduling: ";
    remedy = "grant it (see upright doctor), reduce the processor's load, or lower sample_rate_hz";
  }
  return "more than " + std::to_string(limits.max_periods_late) + " periods in a row overran, starting" +
         when + "; " + cause + remedy;
}

/// For counts that are older than the watchdog allows, or missing.
std::string for_longer_than(const LoopLimits& limits) {
  return " for more than the watchdog time of " + brief(limits.watchdog_s * 1e3) + " ms";
}

}  // namespace

std::string sentence_of(const LoopOutcome& o, const LoopLimits& limits) {
  const std::string when = " in cycle " + std::to_string(o.first_bad_tick) + " (" + brief(o.time_s) + " s)";
  switch (o.reason) {
    case StopReason::duration:
      return "the run completed its full duration" + went_on_after(o.counts.link);
    case StopReason::signal:
      return std::string("stopped by ") + name_of_signal(o.signal) + when + ": start again when ready";
    case StopReason::stop_button:
      return "stopped from the live page" + when + ": start again when ready";
    case StopReason::not_finite:
      return "a value was not a finite number" + when + ": check the gains and the sensors";
    case StopReason::stale_encoder:
      return "no new encoder counts arrived" + for_longer_than(limits) + ", starting" + when +
             ": check the link to the encoders";
    case StopReason::stuck_encoder:
      return (o.stuck == StuckEncoder::cart
                  ? std::string("the cart encoder did not count although the applied voltages should have "
                                "moved the cart, starting") +
                        when +
                        ": check the encoder and its cable, that the amplifier is on, and that the cart "
                        "moves freely"
                  : std::string(
                        "the pendulum encoder did not count although the cart's motion should have moved "
                        "the pendulum, starting") +
                        when + ": check the encoder and its cable") +
             "; if all are good, allow for more friction and lag in encoder_watch of the rig file";
    case StopReason::link_lost:
      return "the link failed" + for_longer_than(limits) + " (" + words_for(o) + "), starting" + when +
             ": check the cable, the address and the device";
    case StopReason::rig_fault:
      return words_for(o) + when + ": " + remedy_for(o.fault);
    case StopReason::track_limit:
      return sentence_of_track(o, limits, when);
    case StopReason::fell:
      return sentence_of_fall(o, limits, when);
    case StopReason::overrun:
      return sentence_of_overrun(o, limits, when);
    case StopReason::emergency_stop:
      return "the emergency stop was pressed" + when + ": release it when it is safe";
    case StopReason::log_failed:
      return "the log could not record every row" + when;
    case StopReason::not_ready:
      return "the rig did not reach the starting position of the experiment" + when +
             ": bring it there (at rest, or held upright, as the experiment requires)";
  }
  return "unknown reason";
}

}  // namespace upright
