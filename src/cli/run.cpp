// `upright run`: closes the loop on a rig and leaves a run directory.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "commands.hpp"
#include "histogram_json.hpp"
#include "live.hpp"
#include "options.hpp"
#include "signals.hpp"
#include "upright/analysis/delay_margin.hpp"
#include "upright/control/predictor.hpp"
#include "upright/hal/gpio_rig.hpp"
#include "upright/hal/guarded_rig.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/histogram_text.hpp"
#include "upright/runtime/session.hpp"
#include "upright/runtime/wait_upright.hpp"

namespace upright::cli {

namespace {

constexpr double degrees_per_rad = 180.0 / std::numbers::pi;

struct Arguments {
  std::string rig, gains, plant, out = "runs", label = "run", live_port;
  std::optional<double> delay_s, theta0_deg;
  double duration_s = 10.0, wait_s = WaitOptions{}.patience_s;
  std::optional<std::uint64_t> seed;
  RealtimeRequest realtime;
  bool fast = false, as_json = false;
};

void refuse_what_only_simulation_can(const Arguments& arguments) {
  const std::string why = ": " + arguments.rig + " is not a simulated rig";
  if (arguments.fast) throw ConfigError("remove --fast, or name a simulated rig" + why);
  if (arguments.theta0_deg) throw ConfigError("remove --theta0-deg, or name a simulated rig" + why);
  if (arguments.seed) throw ConfigError("remove --seed, or name a simulated rig" + why);
}

RunSetup make_setup(const Arguments& arguments) {
  RunSetup setup;
  setup.command = command_line();
  setup.label = arguments.label;
  setup.duration_s = arguments.duration_s;
  setup.fast = arguments.fast;
  setup.seed = arguments.seed.value_or(1);
  setup.control = read_gain_file(arguments.gains);
  if (arguments.delay_s) setup.control.delay_s = *arguments.delay_s;
  setup.rig = read_rig_file(arguments.rig);
  if (is_simulated(setup.rig))
    setup.plant = read_plant_file(setup.rig.simulated->plant);
  else
    refuse_what_only_simulation_can(arguments);
  if (arguments.theta0_deg) setup.theta0_rad = *arguments.theta0_deg / degrees_per_rad;
  setup.limits.periods =
      static_cast<std::uint64_t>(std::llround(arguments.duration_s * setup.control.sample_rate_hz));
  setup.limits.track_limit_m = setup.rig.track_limit_m;
  setup.limits.coast_s = setup.rig.coast_s;
  setup.limits.fall_angle_rad = setup.rig.fall_angle_rad;
  setup.limits.watchdog_s = setup.rig.watchdog_s;
  setup.limits.most_periods_late = default_periods_late(setup.control.period_s());
  return setup;
}

/// The model to judge the gains by: the one named, the simulated rig's, or the predictor's.
std::optional<Plant> model_of(const Arguments& arguments, const RunSetup& setup) {
  if (!arguments.plant.empty()) return read_plant_file(arguments.plant);
  if (setup.plant) return setup.plant;
  if (setup.control.compensation.kind == CompensationKind::predictor)
    return read_plant_file(setup.control.compensation.plant);
  return std::nullopt;
}

/// What the gains tolerate, where there is a model with a pendulum to tell.
std::optional<OverrunTolerance> tolerance_of(const Arguments& arguments, const RunSetup& setup) {
  const std::optional<Plant> model = model_of(arguments, setup);
  if (!model || !model->pendulum) return std::nullopt;
  return overrun_tolerance(*model, setup.control);
}

/// The overrun limit that follows: what the gains tolerate, but not less than a kernel's ordinary hiccup
/// makes and not more than leaves time before a fall.
std::uint64_t periods_late(const OverrunTolerance& tolerance, double period_s) {
  constexpr int fewest = 3;
  const int tolerated = std::max(fewest, tolerance.missed_periods);
  return std::min(static_cast<std::uint64_t>(tolerated), default_periods_late(period_s));
}

std::string tolerance_line(const std::optional<OverrunTolerance>& tolerance, const LoopLimits& limits) {
  const std::string limit = std::to_string(limits.most_periods_late);
  if (!tolerance)
    return "Delay margin: unknown without a model of the rig (--plant); the run stops when more than " +
           limit + " periods in a row are late.";
  return "Delay margin: " + tolerance->sentence + "; the run stops when more than " + limit +
         " periods in a row are late.";
}

std::string delay_line(const ControlConfig& control) {
  const DelayLine delay(control.delay_s, control.period_s());
  if (control.delay_s == 0.0) return "Delay: none";
  const std::string amount = "Delay: " + exact_text(control.delay_s * 1e3) + " ms, ";
  if (delay.exact()) return amount + std::to_string(delay.whole_periods()) + " periods, exact to the sample";
  return amount + exact_text(static_cast<double>(delay.whole_periods()) + delay.fraction()) +
         " periods: linear between two samples, for it is no whole number of them";
}

std::unique_ptr<Rig> make(const RunSetup& setup, Clock& clock) {
  if (is_simulated(setup.rig))
    return with_gpio_lines(guarded(make_simulated_rig(setup.rig, clock, {setup.seed, setup.theta0_rad}),
                                   calibration_in_use(setup.rig)),
                           setup.rig);
  return make_rig(setup.rig, {setup.control.period_s()});
}

void show_live(const LiveStatus& live) {
  std::fprintf(stderr, "\r%8.1f s  angle %+7.2f deg  %+6.2f V  worst lateness %7.0f us ", live.time_s.load(),
               live.theta_rad.load() * degrees_per_rad, live.voltage_v.load(), live.worst_late_us.load());
}

void show_wait(const WaitStatus& wait, bool on_terminal, bool first) {
  constexpr const char* request =
      "lift the pendulum upright, hold it still and keep the cart off the ends: waiting at zero volts";
  if (on_terminal)
    std::fprintf(stderr, "\r%s, %3.0f s left (angle %+7.2f deg, x %+.3f m; counts %lld, %lld) ", request,
                 wait.left_s, wait.pose.theta_rad * degrees_per_rad, wait.pose.cart_m,
                 static_cast<long long>(wait.cart_counts), static_cast<long long>(wait.pendulum_counts));
  else if (first)
    std::fprintf(stderr, "upright: %s for %.0f s\n", request, wait.left_s);
}

/// On a real rig the operator lifts the pendulum first.
void wait_for_operator(const Arguments& arguments, Rig& rig, Clock& clock, const RigFile& file,
                       const SignalFlag& caught_signal, bool on_terminal, LiveView* view) {
  if (is_simulated(file) || arguments.wait_s <= 0.0) return;
  bool asked = false;
  wait_upright(rig, clock, file, caught_signal, {arguments.wait_s, [&](const WaitStatus& wait) {
                                                   show_wait(wait, on_terminal, !asked);
                                                   if (view != nullptr)
                                                     view->show_waiting(
                                                         "lift the pendulum upright and hold it still",
                                                         arguments.wait_s - wait.left_s, wait.pose);
                                                   asked = true;
                                                 }});
  if (asked && on_terminal) std::fputs("\n", stderr);
}

using Json = nlohmann::ordered_json;

Json json_of(const std::optional<OverrunTolerance>& tolerance) {
  if (!tolerance) return nullptr;
  const bool any = !std::isfinite(tolerance->extra_delay_s);
  return {{"extra_delay_s", any ? Json(nullptr) : Json(tolerance->extra_delay_s)},
          {"missed_periods", tolerance->missed_periods},
          {"sentence", tolerance->sentence}};
}

Json json_of(const LinkCounts& link) {
  Json document;
  for (std::size_t i = 0; i < LinkCounts::kinds; ++i)
    document[name_of(static_cast<LinkTrouble>(i))] = link.cycles[i];
  document["longest"] = link.longest;
  document["recoveries"] = link.recoveries;
  return document;
}

Json json_of(const SessionResult& result, const LoopLimits& limits,
             const std::optional<OverrunTolerance>& tolerance) {
  const LoopOutcome& o = result.outcome;
  const LoopCounts& c = o.counts;
  return {{"run_directory", result.directory.string()},
          {"outcome", result_of(o)},
          {"reason", name_of(o.reason)},
          {"sentence", sentence_of(o, limits)},
          {"stayed_up", o.reason == StopReason::duration},
          {"time_s", o.time_s},
          {"tick", o.first_bad_tick},
          {"worst_theta_rad", o.worst_theta_rad},
          {"worst_cart_m", o.worst_cart_m},
          {"rows_written", result.log.rows_written},
          {"rows_dropped", result.log.rows_dropped},
          {"counts",
           {{"periods", c.periods},
            {"fresh", c.fresh},
            {"stale", c.stale},
            {"faults", c.faults},
            {"missed", c.missed},
            {"overruns_wake", c.overruns_wake},
            {"overruns_read", c.overruns_read},
            {"overruns_compute", c.overruns_compute},
            {"overruns_write", c.overruns_write},
            {"saturated", c.saturated},
            {"writes_failed", c.writes_failed},
            {"page_faults", c.page_faults}}},
          {"link", json_of(c.link)},
          {"timing",
           {{"wake_late", histogram_json(o.wake_late)},
            {"read", histogram_json(o.read)},
            {"compute", histogram_json(o.compute)},
            {"write", histogram_json(o.write)},
            {"cycle", histogram_json(o.cycle)}}},
          {"delay_margin", json_of(tolerance)},
          {"most_periods_late", limits.most_periods_late},
          {"scheduling", result.scheduling.note},
          {"elapsed_s", result.elapsed_s}};
}

void print_link(const LoopOutcome& o) {
  std::string troubles = sentence_of(o.counts.link);
  if (o.counts.writes_failed > 0)
    troubles += (troubles.empty() ? "" : "; ") + std::to_string(o.counts.writes_failed) + " failed writes";
  if (troubles.empty()) return;
  std::printf("Link: %s%s.\n", o.reason == StopReason::duration ? "went on after " : "", troubles.c_str());
}

void print_timing(const SessionResult& result) {
  const LoopOutcome& o = result.outcome;
  const LoopCounts& c = o.counts;
  std::printf("Timing: woke late by %.0f us (99.9 %%), %.0f us at worst; a cycle took %.0f us at worst.\n",
              o.wake_late.quantile_us(0.999), o.wake_late.max_us(), o.cycle.max_us());
  std::printf("How many periods (bars: logarithm of the count)\n");
  for (const std::string& line : histogram_lines({{"woke late by", o.wake_late}, {"took", o.cycle}}))
    std::printf("%s\n", line.c_str());
  std::printf("Overruns: %llu waking, %llu reading, %llu computing, %llu writing; %llu periods missed.\n",
              static_cast<unsigned long long>(c.overruns_wake),
              static_cast<unsigned long long>(c.overruns_read),
              static_cast<unsigned long long>(c.overruns_compute),
              static_cast<unsigned long long>(c.overruns_write), static_cast<unsigned long long>(c.missed));
  std::printf("Scheduling: %s; %llu page faults while it ran.\n", result.scheduling.note.c_str(),
              static_cast<unsigned long long>(c.page_faults));
}

void print_summary(const SessionResult& result, const LoopLimits& limits, bool fast) {
  const LoopOutcome& o = result.outcome;
  const LoopCounts& c = o.counts;
  if (o.reason == StopReason::duration)
    std::printf("Stayed up for %.4g s.\n", o.time_s);
  else
    std::printf("%s after %.4g s: %s.\n", o.reason == StopReason::fell ? "Fell" : "Stopped at zero volts",
                o.time_s, sentence_of(o, limits).c_str());
  std::printf(
      "Worst angle %.3f deg, worst cart position %.1f mm, %llu of %llu periods at the voltage limit.\n",
      o.worst_theta_rad * degrees_per_rad, o.worst_cart_m * 1e3, static_cast<unsigned long long>(c.saturated),
      static_cast<unsigned long long>(c.periods));
  if (fast) {
    std::printf("Virtual time: %.3g times faster than real time.\n", o.time_s / result.elapsed_s);
  } else {
    print_timing(result);
  }
  print_link(o);
  if (result.log.rows_dropped > 0)
    std::printf("Log: %llu rows were dropped, the disk was too slow.\n",
                static_cast<unsigned long long>(result.log.rows_dropped));
  std::printf("%s\n", result.directory.c_str());
  std::fflush(stdout);
}

/// The page that --live asks for.
std::unique_ptr<LiveView> open_live(const Arguments& arguments, const RunSetup& setup) {
  LiveSubject subject;
  subject.title = setup.label + " on " + setup.rig.file.filename().string();
  subject.rig = &setup.rig;
  subject.plant = setup.plant ? &*setup.plant : nullptr;
  subject.period_s = setup.control.period_s();
  subject.realtime = arguments.realtime;
  subject.fast = arguments.fast;
  return open_live(arguments.live_port, subject, arguments.as_json ? stderr : stdout);
}

LiveState end_of(const SessionResult& result, const LoopLimits& limits) {
  const bool completed = result.outcome.reason == StopReason::duration;
  return {completed ? LiveState::Kind::completed : LiveState::Kind::stopped,
          sentence_of(result.outcome, limits) + ". The run is in " + result.directory.string()};
}

SessionResult balance(const Arguments& arguments, RunSetup setup, const SignalFlag& caught_signal,
                      LiveView* view) {
  MonotonicClock real_clock;
  VirtualClock virtual_clock;
  Clock& clock = arguments.fast ? static_cast<Clock&>(virtual_clock) : real_clock;
  const std::unique_ptr<Rig> rig = make(setup, clock);
  rig->open();
  constexpr double patience_s = 2.0;
  find_zero(*rig, clock, setup.rig, patience_s);
  const bool on_terminal = ::isatty(STDERR_FILENO) != 0;
  wait_for_operator(arguments, *rig, clock, setup.rig, caught_signal, on_terminal, view);

  SessionOptions options;
  options.out = arguments.out;
  options.realtime = arguments.realtime;
  options.compensator = make_compensator(setup.control);
  options.watcher = view;
  if (on_terminal && !arguments.fast) options.show = show_live;
  const LoopLimits limits = setup.limits;
  if (view != nullptr) view->say({LiveState::Kind::running, "balancing"});
  SessionResult result = run_session(std::move(setup), *rig, clock, caught_signal, std::move(options));
  if (on_terminal && !arguments.fast) std::fputs("\n", stderr);
  if (view != nullptr) view->end(end_of(result, limits));
  return result;
}

ExitCode run(const Arguments& arguments) {
  RunSetup setup = make_setup(arguments);
  const std::optional<OverrunTolerance> tolerance = tolerance_of(arguments, setup);
  if (tolerance) setup.limits.most_periods_late = periods_late(*tolerance, setup.control.period_s());
  if (!arguments.as_json)
    std::cout << delay_line(setup.control) << ".\n" << tolerance_line(tolerance, setup.limits) << std::endl;
  const LoopLimits limits = setup.limits;
  const SignalFlag& caught_signal = catch_signals();
  const std::unique_ptr<LiveView> view = open_live(arguments, setup);
  const SessionResult result =
      shown_by(view.get(), [&] { return balance(arguments, std::move(setup), caught_signal, view.get()); });

  if (arguments.as_json)
    std::cout << json_of(result, limits, tolerance).dump(2, ' ', false, Json::error_handler_t::replace)
              << "\n";
  else
    print_summary(result, limits, arguments.fast);
  if (!result.log.failure.empty()) std::cerr << "upright: " << result.log.failure << "\n";
  if (!result.outcome_written)
    std::cerr << "upright: free space where the run directory goes: run.yaml could not be completed\n";
  if (result.outcome.reason == StopReason::duration) return ExitCode::done;
  if (arguments.as_json) std::cerr << "upright: " << sentence_of(result.outcome, limits) << "\n";
  return ExitCode::stopped;
}

}  // namespace

void add_run(CommandLine& line) {
  const Command command = line.command(
      "run", "Close the loop on a rig and log it",
      "Example:  upright run --rig config/rigs/simulated.yaml --gains config/gains/exponential.yaml "
      "--duration 60 --theta0-deg 3 --fast\n"
      "The last line of the output is the run directory.");
  const auto a = std::make_shared<Arguments>();
  command.option("--rig", a->rig, "Rig file").required();
  command.option("--gains", a->gains, "Gain file").required();
  command.option("--plant", a->plant,
                 "Model of the rig, whose delay margin limits overruns (a simulated rig's own)");
  command.option("--delay", a->delay_s, "Delay of the feedback [s], in place of the gain file's")
      .in(Range::within(0.0, DelayLine::longest_delay_s));
  constexpr double longest_run_s = 1e6;
  command.option("--duration", a->duration_s, "How long to run [s] (10)").in({0.0, longest_run_s, true});
  command
      .option("--wait", a->wait_s,
              "How long to wait at zero volts for the pendulum to be lifted upright [s], real rigs (30)")
      .in(Range::within(0.0, 86400.0));
  command.option("--theta0-deg", a->theta0_deg, "Initial angle [degree], simulated rigs only")
      .in(Range::within(-180.0, 180.0));
  add_simulated(command, a->seed, a->fast);
  command.option("--out", a->out, "The folder that the run directory is made in (runs)");
  command.option("--label", a->label, "End of the run directory's name (run)");
  add_realtime(command, a->realtime);
  add_live(command, a->live_port);
  command.flag("--json", a->as_json, "One JSON document");
  command.does([a] { return run(*a); });
}

}  // namespace upright::cli
