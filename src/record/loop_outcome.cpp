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
      return "the connection is gone";
    case RigFault::corrupt_reply:
      return "corrupt replies";
    case RigFault::device_restarted:
      return "the device restarted, its counts begin anew";
    case RigFault::counts_jumped:
      return "the counts jumped by more than any motion explains";
    case RigFault::device_refused:
      return "the device refused the request";
    case RigFault::device_busy:
      return "the device answered that it is busy";
    case RigFault::output_kept:
      return "the device acknowledged zero volts and kept its voltage";
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
    case RigFault::watchdog_expired:
      return "the device's own watchdog took the voltage away, for it was not served in time";
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
      return "check the encoder's wiring and that nothing delays the kernel's interrupts, then take the zero "
             "again";
    case RigFault::edges_too_fast:
      return "let the encoder turn more slowly or use a hardware counter, then take the zero again";
    case RigFault::watchdog_expired:
      return "start again, which unlocks the device; give its watchdog more time where the machine cannot be "
             "made quieter";
    default:
      return "reset the device and start again";
  }
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

/// Why a pendulum that was up fell, or ran the cart to the end: what is known of it, and what to do.
std::string why_not_held(const LoopOutcome& o, const LoopLimits& limits) {
  constexpr double soon_s = 1.5;  // a wrong sign ends a run as soon as it began
  if (limits.delay_exceeded)
    return "; its delay or its gains are beyond what the plant bears: see upright margin";
  if (limits.signs_unproven && o.time_s < soon_s)
    return " soon after the start, and nobody checked the signs of this rig: check the signs of encoders and "
           "amplifier with the motor off, then lift the pendulum again";
  return ": see in the report whether a push, the voltage's limit or late periods came before it";
}

std::string sentence_of_fall(const LoopOutcome& o, const LoopLimits& limits, const std::string& when) {
  const std::string limit = brief(limits.fall_angle_rad * 180.0 / std::numbers::pi) + " degrees";
  if (o.first_bad_tick == 0)
    return "it fell before it began: the pendulum was beyond the limit of " + limit + " from upright" + when +
           ": lift it upright, and hold it still until the motor takes over";
  return "it fell, |theta| reached the limit of " + limit + when + why_not_held(o, limits);
}

std::string sentence_of_track(const LoopOutcome& o, const LoopLimits& limits, const std::string& when) {
  const std::string back = ": bring the cart back to the middle";
  if (is_limit_switch(o.fault)) return std::string(words_for(o.fault)) + when + back;
  const std::string limit = "the track limit of " + brief(limits.track_limit_m) + " m";
  const std::string at = ", at x = " + brief(o.last_cart_m) + " m";
  if (o.first_bad_tick == 0) return "the cart was at " + limit + at + ", when the run began" + when + back;
  return "the cart reached " + limit + ", or rolled towards it" + at + when + why_not_held(o, limits);
}

/// The part of the periods that took longest tells what to look at.
std::string sentence_of_overrun(const LoopOutcome& o, const LoopLimits& limits, const std::string& when) {
  const LoopCounts& c = o.counts;
  const std::uint64_t link = c.overruns_read + c.overruns_write;
  std::string cause = "the processor was busy: ",
              remedy = "free it, see upright doctor, or lower sample_rate_hz";
  if (link > c.overruns_wake + c.overruns_compute) {
    cause = "reading and writing the rig took too long: ";
    remedy = "check the link, or lower sample_rate_hz";
  } else if (!o.realtime) {
    cause = "the loop woke late and has no real-time scheduling: ";
    remedy = "grant it, see upright doctor, free the processor, or lower sample_rate_hz";
  }
  return "more than " + std::to_string(limits.most_periods_late) + " periods in a row were late, first" +
         when + "; " + cause + remedy;
}

/// Older counts than the watchdog allows, or none at all.
std::string for_longer_than(const LoopLimits& limits) {
  return " for more than the watchdog's " + brief(limits.watchdog_s * 1e3) + " ms";
}

}  // namespace

std::string sentence_of(const LoopOutcome& o, const LoopLimits& limits) {
  const std::string when = " in cycle " + std::to_string(o.first_bad_tick) + " (" + brief(o.time_s) + " s)";
  switch (o.reason) {
    case StopReason::duration:
      return "the run lasted its whole time" + went_on_after(o.counts.link);
    case StopReason::signal:
      return std::string("stopped by ") + name_of_signal(o.signal) + when + ": start again when ready";
    case StopReason::stop_button:
      return "stopped from the live page" + when + ": start again when ready";
    case StopReason::not_finite:
      return "a value was not a finite number" + when + ": check the gains and the sensors";
    case StopReason::stale_encoder:
      return "no new counts came" + for_longer_than(limits) + ", first" + when + ": check the encoders' link";
    case StopReason::stuck_encoder:
      return (o.stuck == StuckEncoder::cart
                  ? std::string(
                        "the cart's encoder did not count although the applied voltages move the cart, "
                        "first") +
                        when +
                        ": check this encoder and its cable, that the amplifier is on and the cart free"
                  : std::string("the pendulum's encoder did not count although the cart's motion moves the "
                                "pendulum, first") +
                        when + ": check this encoder and its cable") +
             "; if they are good, encoder_watch in the rig file assumes too little friction or lag";
    case StopReason::link_lost:
      return "the link failed" + for_longer_than(limits) + " (" + words_for(o) + "), first" + when +
             ": check cable, address and device";
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
      return "the log could not keep every row" + when;
    case StopReason::not_ready:
      return "the rig did not come to where the experiment starts" + when +
             ": bring it there (at rest, or held upright as it says)";
  }
  return "unknown reason";
}

}  // namespace upright
