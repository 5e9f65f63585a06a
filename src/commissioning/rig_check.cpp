#include "rig_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "base/angle_units.hpp"
#include "runtime/device_clock.hpp"
#include "runtime/sleep_policy.hpp"

namespace upright {

namespace {

bool signalled(const SignalFlag& signal) {
  return signal.load(std::memory_order_relaxed) != 0;
}

struct Spread {
  std::int64_t low = 0, high = 0;
};

Spread spread_of(const std::vector<EncoderCounts>& counts, std::int64_t EncoderCounts::*encoder) {
  const auto [low, high] = std::minmax_element(
      counts.begin(), counts.end(),
      [encoder](const EncoderCounts& a, const EncoderCounts& b) { return a.*encoder < b.*encoder; });
  return {(*low).*encoder, (*high).*encoder};
}

std::string zero_remedy(const EncoderCounts& counts) {
  return "move the cart to the middle and set zero: {at: counts, cart_counts: " +
         std::to_string(counts.cart) + ", pendulum_counts: " + std::to_string(counts.pendulum) +
         ", pose: hanging}";
}

/// The next fresh pose, or none within the time.
std::optional<Pose> next_pose(Rig& rig, Clock& clock, PoseScaler& scaler, std::int64_t until_ns,
                              const SignalFlag& signal) {
  constexpr std::int64_t pause_ns = 5'000'000;
  while (clock.now_ns() < until_ns && !signalled(signal)) {
    const RigReading reading = rig.read();
    clock.sleep_until(clock.now_ns() + pause_ns);
    if (reading.status == RigStatus::fresh) return scaler.scale(reading.cart_counts, reading.pendulum_counts);
  }
  return std::nullopt;
}

struct AskedMove {
  HandMove move;
  const char* subject;
  const char* words;
  const char* key;
};

/// Seven parameters: those of `next_pose` beside the request and how to ask.
Finding ask_for(const AskedMove& asked, Rig& rig, Clock& clock, PoseScaler& scaler, double patience_s,
                const SignalFlag& signal, const std::function<void(const std::string&)>& ask) {
  ask(asked.words);
  const std::int64_t until_ns = clock.now_ns() + static_cast<std::int64_t>(1e9 * patience_s);
  std::optional<Pose> pose = next_pose(rig, clock, scaler, until_ns, signal);
  if (pose) {
    const HandTest test(asked.move, *pose);
    for (; pose; pose = next_pose(rig, clock, scaler, until_ns, signal)) {
      const HandAnswer answer = test.look(*pose);
      if (answer == HandAnswer::agrees) return {asked.subject, Health::good, "the sign is right", ""};
      if (answer == HandAnswer::opposes)
        return {asked.subject, Health::bad, "it counts in the wrong direction",
                std::string("reverse ") + asked.key};
    }
  }
  return {asked.subject, Health::not_examined, "no motion was seen",
          std::string("run this again and ") + asked.words +
              "; if it still sees none, check the encoder's cable"};
}

/// The counter for a failed reading.
std::uint64_t& refused_by(LinkProbe& probe, const RigReading& reading) {
  if (is_emergency_stop(reading.fault)) return probe.emergency_stops;
  if (is_limit_switch(reading.fault)) return probe.limit_switches;
  return probe.failed;
}

/// An input that the operator is asked to activate and release.
struct AskedInput {
  std::string subject;
  bool (*is_it)(RigFault);
  std::string trip, release;
  const char* key;
};

/// The operator beside the rig, and how long the program waits for each action.
struct HandTrial {
  Rig& rig;
  Clock& clock;
  double patience_s;
  const SignalFlag& signal;
  const std::function<void(const std::string&)>& ask;

  /// Asks, and waits until the input is as asked for. Only fresh counts show that it was released: another
  /// fault hides its state.
  bool comes(const AskedInput& input, bool active) const {
    constexpr std::int64_t pause_ns = 5'000'000;
    ask(active ? input.trip : input.release);
    const std::int64_t until_ns = clock.now_ns() + static_cast<std::int64_t>(1e9 * patience_s);
    while (clock.now_ns() < until_ns && !signalled(signal)) {
      const RigReading reading = rig.read();
      if (active ? input.is_it(reading.fault) : reading.status == RigStatus::fresh) return true;
      clock.sleep_until(clock.now_ns() + pause_ns);
    }
    return false;
  }

  Finding of(const AskedInput& input) const {
    const std::string wiring = std::string("check its wiring and its active level in ") + input.key;
    if (input.is_it(rig.read().fault) && !comes(input, false))
      return {input.subject, Health::bad, "it is active, and its release was not seen", wiring};
    if (!comes(input, true))
      return {input.subject, Health::bad, "it was not seen",
              "run this again and " + input.trip + "; if it is still not seen, " + wiring};
    if (!comes(input, false))
      return {input.subject, Health::bad, "it was seen, but its release was not", wiring};
    return {input.subject, Health::good, "it and its release were seen", ""};
  }
};

/// How a device that is the clock samples.
LinkProbe probe_device_clock(Rig& rig, Clock& clock, double rate_hz, double duration_s,
                             const SignalFlag& signal) {
  LinkProbe probe;
  DeviceClock device;
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / rate_hz));
  const std::int64_t end_ns = clock.now_ns() + static_cast<std::int64_t>(1e9 * duration_s);
  LoopPhase phase{clock.now_ns() + period_ns, period_ns, 0};
  std::uint64_t seen = rig.wait_next(clock.now_ns()).number;
  while (clock.now_ns() < end_ns && !signalled(signal)) {
    const std::int64_t until_ns = clock.now_ns() + 2 * period_ns;
    const DeviceSample sample = rig.wait_next(until_ns);
    if (sample.number == seen)
      clock.sleep_until(until_ns);
    else if (device.take(sample, phase))
      device.wake(phase, clock.now_ns());
    seen = sample.number;
    const RigReading reading = rig.read();
    if (reading.status != RigStatus::fresh)
      ++refused_by(probe, reading);
    else if (clock.now_ns() + nanoseconds_per_second >= end_ns)
      probe.counts.push_back({reading.cart_counts, reading.pendulum_counts});
  }
  probe.device_clock = device.timing(period_ns);
  return probe;
}

Finding judge_device_clock(const LinkProbe& probe, const DeviceTiming& timing) {
  constexpr double poor_share = 1e-3, bad_share = 0.02;
  if (timing.samples < 2) return {"link", Health::bad, "no sample came", "check the card and its cable"};
  const double lost_share =
      static_cast<double>(timing.lost) / static_cast<double>(timing.lost + timing.samples);
  char what[200];
  std::snprintf(
      what, sizeof what,
      "the device is the clock: a sample every %.2f us (%+.0f ppm); of %llu samples %llu were lost, "
      "and %llu readings failed",
      1e6 * timing.period_s, timing.drift_ppm, static_cast<unsigned long long>(timing.lost) + timing.samples,
      static_cast<unsigned long long>(timing.lost), static_cast<unsigned long long>(probe.failed));
  if (lost_share <= poor_share) return {"link", Health::good, what, ""};
  return {"link", lost_share > bad_share ? Health::bad : Health::poor, what,
          "free the processor and the bus of the card, or remove quanser_hil.clock, so that the loop follows "
          "the computer's clock"};
}

}  // namespace

LinkProbe probe_link(Rig& rig, Clock& clock, double rate_hz, double duration_s, const SignalFlag& signal) {
  if (rig.is_clock()) return probe_device_clock(rig, clock, rate_hz, duration_s, signal);
  LinkProbe probe;
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / rate_hz));
  const auto periods = static_cast<std::uint64_t>(std::max(1.0, duration_s * rate_hz));
  const auto last_second = static_cast<std::uint64_t>(rate_hz);
  LoopPhase phase{clock.now_ns() + period_ns, period_ns, 0};
  while (phase.next_tick < periods && !signalled(signal)) {
    clock.sleep_until(phase.due_ns(phase.next_tick));
    const std::int64_t asked_ns = clock.now_ns();
    const Wake wake = wake_at(phase, asked_ns);
    const RigReading reading = rig.read();
    if (reading.status != RigStatus::fresh) {
      ++refused_by(probe, reading);
      continue;
    }
    probe.round_trip.add(clock.now_ns() - asked_ns);
    if (wake.tick + last_second >= periods)
      probe.counts.push_back({reading.cart_counts, reading.pendulum_counts});
  }
  return probe;
}

namespace {

/// A loop tolerates 1 % of late replies. A single late reply in a short measurement does not determine the
/// rate.
double share_in_time(std::uint64_t trips) {
  constexpr double share = 0.99, one_outlier = 1.5;
  const auto count = static_cast<double>(trips);
  return std::clamp((count - one_outlier) / std::max(count, 1.0), 0.0, share);
}

}  // namespace

double highest_rate_hz(const DurationHistogram& round_trip) {
  constexpr double exchanges = 2.0;
  const double exchange_s = 1e-6 * round_trip.quantile_us(share_in_time(round_trip.count()));
  return exchange_s > 0.0 ? 1.0 / (exchanges * exchange_s) : 0.0;
}

std::string verdict_sentence(Health verdict, double rate_hz, const DurationHistogram* round_trip) {
  if (verdict == Health::bad) return "not fit to run a rig: see the lines marked bad";
  const double carried_hz =
      round_trip != nullptr && round_trip->count() > 0 ? highest_rate_hz(*round_trip) : rate_hz;
  if (carried_hz < rate_hz) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "not fit for %.4g Hz, because the link supports at most %.0f Hz: lower sample_rate_hz",
                  rate_hz, std::floor(carried_hz));
    return text;
  }
  if (verdict == Health::poor) return "fit to run a rig, but could be improved: see the remedies";
  return "fit to run a rig";
}

Finding judge_link(const LinkProbe& probe, double rate_hz) {
  const DurationHistogram& trips = probe.round_trip;
  if (trips.count() == 0 && probe.emergency_stops + probe.limit_switches > 0)
    return {"link", Health::not_examined,
            std::string(probe.emergency_stops > 0 ? "the emergency stop is pressed"
                                                  : "a limit switch is active") +
                ", so no counts are read",
            "release it and run this again"};
  if (probe.device_clock) return judge_device_clock(probe, *probe.device_clock);
  if (trips.count() == 0)
    return {"link", Health::bad, "no reply was received",
            "check the cable, the address and response_timeout_s"};
  const double carried_hz = highest_rate_hz(trips);
  const std::uint64_t asked = probe.failed + trips.count();
  char what[240];
  std::snprintf(what, sizeof what,
                "round trip %.0f us (50 %%), %.0f us (99.9 %%), %.0f us (max), period %.0f us; "
                "%llu of %llu requests failed; supports %.0f Hz",
                trips.quantile_us(0.5), trips.quantile_us(0.999), trips.max_us(), 1e6 / rate_hz,
                static_cast<unsigned long long>(probe.failed), static_cast<unsigned long long>(asked),
                carried_hz);
  const double failed_share = static_cast<double>(probe.failed) / static_cast<double>(asked);
  constexpr double poor_share = 1e-3, bad_share = 0.02;
  if (failed_share > bad_share)
    return {"link", Health::bad, what, "check the cable and the device, or raise response_timeout_s"};
  if (carried_hz < rate_hz || failed_share > poor_share)
    return {"link", Health::poor, what,
            "lower sample_rate_hz, raise the baud rate, or keep other traffic off the link"};
  return {"link", Health::good, what, ""};
}

Finding judge_zero(const std::vector<EncoderCounts>& counts, const Calibration& calibration) {
  constexpr std::int64_t at_rest_counts = 2;
  constexpr double close_rad = 1.0 / degrees_per_radian;
  if (counts.empty())
    return {"zero", Health::not_examined, "no counts were received", "repair the link first"};
  const Spread cart = spread_of(counts, &EncoderCounts::cart);
  const Spread pendulum = spread_of(counts, &EncoderCounts::pendulum);
  if (cart.high - cart.low > at_rest_counts || pendulum.high - pendulum.low > at_rest_counts)
    return {"zero", Health::not_examined, "the rig is not at rest",
            "let the pendulum hang still and run this again"};
  if (calibration.zero_at_start)
    return {"zero", Health::good,
            "set when a run starts, with the pendulum " +
                std::string(calibration.zero_pose == ZeroPose::hanging ? "hanging" : "upright"),
            ""};
  PoseScaler scaler(calibration);
  const Pose pose = scaler.scale(counts.back().cart, counts.back().pendulum);
  const double off_rad = std::remainder(pose.theta_rad - std::numbers::pi, 2.0 * std::numbers::pi);
  char what[120];
  std::snprintf(what, sizeof what, "the pendulum rests %.2f degrees from hanging, the cart at %+.1f mm",
                off_rad * degrees_per_radian, 1e3 * pose.cart_m);
  if (std::abs(off_rad) <= close_rad) return {"zero", Health::good, what, ""};
  return {"zero", Health::poor, what, "if the pendulum hangs, " + zero_remedy(counts.back())};
}

HandAnswer HandTest::look(const Pose& now) const {
  constexpr double felt_m = 0.02, felt_rad = 0.2;
  // theta grows from upright toward +x. Near hanging it decreases when the bob moves toward +x.
  const double moved = move_ == HandMove::cart_to_plus ? (now.cart_m - start_.cart_m) / felt_m
                                                       : (start_.theta_rad - now.theta_rad) / felt_rad;
  if (std::abs(moved) < 1.0) return HandAnswer::nothing_yet;
  return moved > 0.0 ? HandAnswer::agrees : HandAnswer::opposes;
}

std::vector<Finding> examine_signs_by_hand(Rig& rig, Clock& clock, const Calibration& calibration,
                                           double patience_s, const SignalFlag& signal,
                                           const std::function<void(const std::string&)>& ask) {
  PoseScaler scaler(calibration);
  constexpr AskedMove cart{HandMove::cart_to_plus, "cart's sign",
                           "push the cart a few centimetres in the +x direction", "calibration.cart.sign"};
  constexpr AskedMove bob{HandMove::bob_to_plus, "pendulum's sign",
                          "lift the bob of the hanging pendulum in the +x direction",
                          "calibration.pendulum.sign"};
  return {ask_for(cart, rig, clock, scaler, patience_s, signal, ask),
          ask_for(bob, rig, clock, scaler, patience_s, signal, ask)};
}

std::vector<Finding> name_missing_inputs(const SafetyInputs& inputs) {
  std::vector<Finding> findings;
  if (!inputs.emergency_stop)
    findings.push_back(
        {"emergency stop", Health::not_examined, "no emergency stop is wired",
         "wire an emergency stop that cuts the amplifier's supply, and connect one of its contacts as "
         "gpio.emergency_stop, so that it also ends the run"});
  if (inputs.limit_switches == 0)
    findings.push_back({"limit switches", Health::not_examined, "no limit switch is wired",
                        "wire one at each end of the track as gpio.limit_switches; without them, only "
                        "track.limit_m protects the ends"});
  return findings;
}

std::vector<Finding> judge_safety_inputs(const SafetyInputs& inputs, const LinkProbe& probe) {
  std::vector<Finding> findings;
  if (inputs.emergency_stop)
    findings.push_back(probe.emergency_stops > 0
                           ? Finding{"emergency stop", Health::poor, "it is pressed or its wire is broken",
                                     "release it when it is safe"}
                           : Finding{"emergency stop", Health::not_examined, "wired, not pressed",
                                     "test it with --by-hand"});
  if (inputs.limit_switches > 0)
    findings.push_back(probe.limit_switches > 0
                           ? Finding{"limit switches", Health::poor, "one is tripped or its wire is broken",
                                     "move the cart to the middle"}
                           : Finding{"limit switches", Health::not_examined,
                                     std::to_string(inputs.limit_switches) + " wired, none tripped",
                                     "test each with --by-hand"});
  return findings;
}

Finding judge_lines(const LinkProbe& probe) {
  const std::uint64_t read = probe.round_trip.count() + probe.emergency_stops + probe.limit_switches;
  const std::string times = std::to_string(read) + " times";
  if (probe.failed == 0) return {"digital lines", Health::good, "read " + times, ""};
  return {"digital lines", Health::bad,
          "read " + times + "; " + std::to_string(probe.failed) + " attempts failed",
          "check the GPIO chip and its cable"};
}

std::vector<Finding> name_driven_lines(const GpioRig& gpio) {
  const auto held = [&gpio](int line) { return "line " + std::to_string(line) + " of " + gpio.chip; };
  std::vector<Finding> findings;
  if (gpio.amplifier_enable)
    findings.push_back(
        {"amplifier enable", Health::not_examined,
         held(gpio.amplifier_enable->line) + " is reserved, and off until the first voltage of a run",
         "check that the amplifier is off now; if it is on, reverse gpio.amplifier_enable.active"});
  if (gpio.heartbeat)
    findings.push_back({"heartbeat", Health::not_examined,
                        held(*gpio.heartbeat) + " is reserved, and constant until a run starts",
                        "check that the external watchdog keeps the amplifier off now"});
  return findings;
}

std::vector<Finding> examine_safety_inputs_by_hand(Rig& rig, Clock& clock, double patience_s,
                                                   const SignalFlag& signal,
                                                   const std::function<void(const std::string&)>& ask) {
  const SafetyInputs inputs = rig.safety_inputs();
  const HandTrial trial{rig, clock, patience_s, signal, ask};
  std::vector<Finding> findings;
  if (inputs.emergency_stop)
    findings.push_back(trial.of({"emergency stop", is_emergency_stop, "press the emergency stop",
                                 "release the emergency stop", "gpio.emergency_stop"}));
  for (int i = 1; i <= inputs.limit_switches; ++i) {
    std::string which;
    if (inputs.limit_switches > 1)
      which.append(" ")
          .append(std::to_string(i))
          .append(" of ")
          .append(std::to_string(inputs.limit_switches));
    findings.push_back(
        trial.of({"limit switch" + which, is_limit_switch, "trip limit switch" + which + " with the cart",
                  "move the cart off the limit switch", "gpio.limit_switches"}));
  }
  return findings;
}

}  // namespace upright
