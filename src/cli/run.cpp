// `upright run`: closes the loop on a rig and leaves a run directory.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/angle_units.hpp"
#include "commands.hpp"
#include "control/filter_model.hpp"
#include "histogram_json.hpp"
#include "json_number.hpp"
#include "live.hpp"
#include "live/row_watchers.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "record/histogram_text.hpp"
#include "record/sign_record.hpp"
#include "record/stop_report.hpp"
#include "runtime/overrun_limit.hpp"
#include "runtime/wait_upright.hpp"
#include "signals.hpp"
#include "stop_watcher.hpp"
#include "stream.hpp"
#include "upright/base/error.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/session.hpp"

namespace upright::cli {

namespace {

struct RunArguments {
  std::string rig, gains, plant, out = "runs", label = "run", live_port, stream;
  std::optional<double> delay_s, theta0_deg, wait_s;
  double duration_s = 10.0;
  std::optional<std::uint64_t> seed;
  RealtimeRequest realtime;
  bool fast = false, as_json = false, unchecked = false, force = false;
};

void refuse_what_only_simulation_can(const RunArguments& arguments) {
  const std::string why = arguments.rig + " is not a simulated rig: remove ",
                    or_else = ", or use a simulated rig";
  if (arguments.fast) throw ConfigError(why + "--fast" + or_else);
  if (arguments.theta0_deg) throw ConfigError(why + "--theta0-deg" + or_else);
  if (arguments.seed) throw ConfigError(why + "--seed" + or_else);
}

void refuse_what_only_hardware_can(const RunArguments& arguments, const RigFile& rig) {
  if (arguments.wait_s)
    throw ConfigError(arguments.rig +
                      " is a simulated rig, which starts upright without an operator: remove --wait");
  if (!arguments.plant.empty())
    throw ConfigError(arguments.rig + " is a simulated rig and names its own plant (" +
                      rig.simulated->plant.string() +
                      "): remove --plant, or name the other plant in a copy of the rig file");
}

/// The model to judge the gains by: the one named, the simulated rig's, or the predictor's.
std::optional<Plant> model_of(const RunArguments& arguments, const RunSetup& setup) {
  if (!arguments.plant.empty()) return read_plant_file(arguments.plant);
  if (setup.plant) return setup.plant;
  if (setup.control.compensation.kind == CompensationKind::predictor)
    return read_plant_file(setup.control.compensation.plant);
  return std::nullopt;
}

RunSetup make_setup(const RunArguments& arguments) {
  RunSetup setup;
  setup.command = command_line();
  setup.label = arguments.label;
  setup.duration_s = arguments.duration_s;
  setup.fast = arguments.fast;
  setup.seed = arguments.seed.value_or(1);
  setup.control = read_gain_file(arguments.gains);
  if (arguments.delay_s) setup.control.delay_s = *arguments.delay_s;
  setup.rig = read_rig_file(arguments.rig);
  if (is_simulated(setup.rig)) {
    refuse_what_only_hardware_can(arguments, setup.rig);
    setup.plant = read_plant_file(setup.rig.simulated->plant);
  } else {
    refuse_what_only_simulation_can(arguments);
  }
  const Calibration& encoders = setup.rig.calibration;
  setup.control = with_encoders(setup.control, encoders.cart.per_count, encoders.pendulum.per_count);
  require_link_fits(setup.rig, setup.control.period_s());
  require_spin_fits(arguments.realtime.spin_us.value_or(setup.rig.spin_us), setup.control.period_s());
  if (arguments.theta0_deg) setup.theta0_rad = *arguments.theta0_deg / degrees_per_radian;
  setup.limits = rig_limits(setup.rig, model_of(arguments, setup));
  setup.limits.periods =
      static_cast<std::uint64_t>(std::llround(arguments.duration_s * setup.control.sample_rate_hz));
  return setup;
}

std::string delay_line(const ControlConfig& control) {
  const DelayLine delay(control.delay_s, control.period_s());
  if (control.delay_s == 0.0) return "Delay: none";
  const std::string amount = "Delay: " + exact_text(control.delay_s * 1e3) + " ms, ";
  if (delay.exact()) return amount + std::to_string(delay.whole_periods()) + " periods, exact to the sample";
  return amount + exact_text(static_cast<double>(delay.whole_periods()) + delay.fraction()) +
         " periods, interpolated linearly between samples";
}

std::unique_ptr<Rig> make(const RunSetup& setup, Clock& clock) {
  if (is_simulated(setup.rig))
    return assembled(make_simulated_rig(setup.rig, clock, {setup.seed, setup.theta0_rad}), setup.rig);
  return make_rig(setup.rig, {setup.control.period_s()});
}

void show_run(const LiveStatus& live) {
  std::fprintf(stderr, "\r%8.1f s  angle %+7.2f deg  %+6.2f V  worst lateness %7.0f us ", live.time_s.load(),
               live.theta_rad.load() * degrees_per_radian, live.voltage_v.load(), live.worst_late_us.load());
}

std::string seconds(double value_s) {
  return std::to_string(std::llround(value_s)) + " s";
}

void show_wait(const WaitStatus& wait, bool on_terminal, bool first) {
  constexpr const char* request =
      "lift the pendulum upright, hold it still and keep the cart away from the ends: waiting at zero volts";
  if (on_terminal)
    std::fprintf(stderr, "\r%s, %3.0f s left (angle %+7.2f deg, x %+.3f m; counts %lld, %lld) ", request,
                 wait.left_s, wait.pose.theta_rad * degrees_per_radian, wait.pose.cart_m,
                 static_cast<long long>(wait.cart_counts), static_cast<long long>(wait.pendulum_counts));
  else if (first)
    std::fprintf(stderr, "upright: %s for %.0f s\n", request, wait.left_s);
}

/// On a real rig the operator lifts the pendulum first. Seven parameters: all that a run has open by then.
void wait_for_operator(const RunArguments& arguments, Rig& rig, Clock& clock, const RigFile& file,
                       const SignalFlag& caught_signal, bool on_terminal, LiveView* view) {
  const double wait_s = arguments.wait_s.value_or(WaitOptions{}.patience_s);
  if (is_simulated(file) || wait_s <= 0.0) return;
  bool asked = false;
  wait_upright(rig, clock, file, caught_signal, {wait_s, [&](const WaitStatus& wait) {
                                                   show_wait(wait, on_terminal, !asked);
                                                   if (view != nullptr)
                                                     view->show_waiting(
                                                         "lift the pendulum upright and hold it still",
                                                         wait_s - wait.left_s, wait.pose);
                                                   asked = true;
                                                 }});
  if (asked && on_terminal) std::fputs("\n", stderr);
}

using Json = nlohmann::ordered_json;

Json json_of(const std::optional<OverrunTolerance>& tolerance) {
  if (!tolerance) return nullptr;
  return {{"stabilized", tolerance->stabilized},
          {"exceeded", tolerance->exceeded()},
          {"critical_delay_s", finite_or_null(tolerance->critical_delay_s)},
          {"extra_delay_s", finite_or_null(tolerance->extra_delay_s)},
          {"missed_periods", tolerance->missed_periods},
          {"sentence", tolerance->sentence}};
}

/// Of what for_each_count lists.
template <class Counts>
Json json_of_counts(const Counts& counts) {
  Json document;
  for_each_count(counts, [&](const char* name, auto count) { document[name] = count; });
  return document;
}

Json json_of(const SessionResult& result, const LoopLimits& limits, const OverrunLimit& overrun) {
  const LoopOutcome& o = result.outcome;
  Json document = {{"run_directory", result.directory.string()},
                   {"outcome", result_of(o)},
                   {"reason", name_of(o.reason)},
                   {"sentence", sentence_of(o, limits, result.log)},
                   {"stayed_up", o.reason == StopReason::duration}};
  for_each_fact(o.stop, [&](const char* name, const auto& fact) { document[name] = fact; });
  document["time_s"] = o.time_s;
  document["tick"] = o.first_bad_tick;
  document["worst_theta_rad"] = o.worst_theta_rad;
  document["worst_cart_m"] = o.worst_cart_m;
  document["rows_written"] = result.log.rows_written;
  document["rows_dropped"] = result.log.rows_dropped;
  document["counts"] = json_of_counts(o.counts);
  document["link"] = json_of_counts(o.counts.link);
  if (o.device_clock)
    for_each_fact(*o.device_clock,
                  [&](const char* name, auto value) { document["device_clock"][name] = value; });
  for_each_timing(o, [&](const char* name, const DurationHistogram& durations) {
    document["timing"][name] = histogram_json(durations);
  });
  document["delay_margin"] = json_of(overrun.tolerance);
  document["most_periods_late"] = limits.max_periods_late;
  document["overrun_limit"] = overrun.sentence;
  document["warning"] = overrun.warning.empty() ? Json(nullptr) : Json(overrun.warning);
  document["scheduling"] = result.scheduling.note;
  document["elapsed_s"] = result.elapsed_s;
  return document;
}

void print_link(const LoopOutcome& o) {
  std::string troubles = sentence_of(o.counts.link);
  if (o.counts.writes_failed > 0)
    troubles += (troubles.empty() ? "" : "; ") + std::to_string(o.counts.writes_failed) + " failed writes";
  if (troubles.empty()) return;
  std::printf("Link: %s%s.\n", o.reason == StopReason::duration ? "the run continued after " : "",
              troubles.c_str());
}

void print_device_clock(const DeviceTiming& timing) {
  std::printf("Clock: the device's; its period was %+.0f ppm off, %llu of %llu samples were lost.\n",
              timing.drift_ppm, static_cast<unsigned long long>(timing.lost),
              static_cast<unsigned long long>(timing.lost) + timing.samples);
}

void print_timing(const SessionResult& result) {
  const LoopOutcome& o = result.outcome;
  const LoopCounts& c = o.counts;
  std::printf(
      "Timing: wake-ups late by %.0f us (99.9 %%), at most %.0f us; the longest cycle took %.0f us.\n",
      o.wake_late.quantile_us(0.999), o.wake_late.max_us(), o.cycle.max_us());
  std::printf("Histogram over the periods (bars: logarithm of the count)\n");
  for (const std::string& line : histogram_lines({{"wake-up late by", o.wake_late}, {"cycle took", o.cycle}}))
    std::printf("%s\n", line.c_str());
  std::printf(
      "Overruns: %llu on waking, %llu on reading, %llu on computing, %llu on writing; %llu periods missed.\n",
      static_cast<unsigned long long>(c.overruns_wake), static_cast<unsigned long long>(c.overruns_read),
      static_cast<unsigned long long>(c.overruns_compute), static_cast<unsigned long long>(c.overruns_write),
      static_cast<unsigned long long>(c.missed));
  std::printf("Scheduling: %s; %llu page faults during the run.\n", result.scheduling.note.c_str(),
              static_cast<unsigned long long>(c.page_faults));
}

void print_summary(const SessionResult& result, const LoopLimits& limits, bool fast) {
  const LoopOutcome& o = result.outcome;
  const LoopCounts& c = o.counts;
  if (o.reason == StopReason::duration)
    std::printf("Stayed upright for %.4g s.\n", o.time_s);
  else
    std::printf("%s after %.4g s: %s.\n",
                o.reason == StopReason::fell ? "Fell"
                : o.stop.zero_confirmed      ? "Stopped at zero volts"
                                             : "Stopped",
                o.time_s, sentence_of(o, limits, result.log).c_str());
  if (!o.stop.done()) std::printf("%s.\n", sentence_of(o.stop).c_str());
  std::printf(
      "Largest angle %.3f deg, largest cart position %.1f mm, %llu of %llu periods at the voltage limit.\n",
      o.worst_theta_rad * degrees_per_radian, o.worst_cart_m * 1e3,
      static_cast<unsigned long long>(c.saturated), static_cast<unsigned long long>(c.periods));
  if (fast) {
    std::printf("Virtual time: %.3g times faster than real time.\n", o.time_s / result.elapsed_s);
  } else {
    print_timing(result);
  }
  print_link(o);
  if (o.device_clock) print_device_clock(*o.device_clock);
  if (result.log.rows_dropped > 0)
    std::printf("Log: %llu rows were dropped because the disk was too slow.\n",
                static_cast<unsigned long long>(result.log.rows_dropped));
  std::printf("%s\n", result.directory.c_str());
  std::fflush(stdout);
}

/// The page that --live asks for.
std::unique_ptr<LiveView> open_live(const RunArguments& arguments, const RunSetup& setup) {
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
  const StopReport& stop = result.outcome.stop;
  return {completed && stop.done() ? LiveState::Kind::completed : LiveState::Kind::stopped,
          (stop.done() ? "" : sentence_of(stop) + ". ") + sentence_of(result.outcome, limits, result.log) +
              ". The run is in " + result.directory.string()};
}

SessionResult balance(const RunArguments& arguments, RunSetup setup, const SignalFlag& caught_signal,
                      LiveView* view, UdpStream* stream) {
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
  options.parts = make_model_parts(setup.control);
  RowWatchers watchers;
  watchers.add(view);
  watchers.add(stream);
  options.watcher = &watchers;
  options.stop = stop_watcher(view);
  const LoopLimits limits = setup.limits;
  // On a terminal a run in real time shows where the cart is instead.
  std::optional<Progress> progress;
  if (on_terminal && !arguments.fast)
    options.show = show_run;
  else
    options.show = [&, duration_s = setup.duration_s](const LiveStatus& live) {
      progress->report(live.time_s / duration_s, seconds(live.time_s) + " of " + seconds(duration_s));
    };
  if (view != nullptr) view->say({LiveState::Kind::running, "balancing"});
  progress.emplace("run");
  SessionResult result = run_session(std::move(setup), *rig, clock, caught_signal, std::move(options));
  progress.reset();
  if (on_terminal && !arguments.fast) std::fputs("\n", stderr);
  if (view != nullptr) view->end(end_of(result, limits));
  return result;
}

ExitCode run(const RunArguments& arguments) {
  RunSetup setup = make_setup(arguments);
  const OverrunLimit overrun = overrun_limit(model_of(arguments, setup), setup.control);
  if (!arguments.force) require_stabilized(overrun);
  if (!arguments.unchecked) require_checked_signs(setup.rig, ", or add --unchecked");
  apply(overrun, setup.limits);
  if (!arguments.as_json)
    std::cout << delay_line(setup.control) << ".\nDelay margin: " << overrun.sentence << "." << std::endl;
  if (!overrun.warning.empty()) std::cerr << "upright: " << overrun.warning << "\n";
  const LoopLimits limits = setup.limits;
  const SignalFlag& caught_signal = catch_signals();
  const std::unique_ptr<UdpStream> stream = open_stream(arguments.stream, arguments.fast);
  const std::unique_ptr<LiveView> view = open_live(arguments, setup);
  const SessionResult result = shown_by(view.get(), [&] {
    return balance(arguments, std::move(setup), caught_signal, view.get(), stream.get());
  });

  if (!arguments.as_json) print_stream(stream.get());
  if (arguments.as_json) {
    Json document = json_of(result, limits, overrun);
    add_stream(document, stream.get());
    std::cout << document.dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print_summary(result, limits, arguments.fast);
  }
  if (!result.log.failure.empty()) std::cerr << "upright: " << result.log.failure << "\n";
  if (result.directory != result.made_at)
    std::cerr << "upright: " << result.made_at.string() << " was moved to " << result.directory.string()
              << " during the run; no row was lost\n";
  if (!result.outcome.stop.done()) {
    std::cerr << "upright: " << sentence_of(result.outcome.stop) << std::endl;
    return ExitCode::device;
  }
  if (result.outcome.reason == StopReason::duration) return ExitCode::done;
  if (arguments.as_json) std::cerr << "upright: " << sentence_of(result.outcome, limits, result.log) << "\n";
  return ExitCode::stopped;
}

}  // namespace

void add_run(CommandLine& line) {
  const Command command = line.command(
      "run", "Run the control loop on a rig and log it",
      "Example:  upright run --rig config/rigs/simulated.yaml --gains config/gains/exponential.yaml "
      "--duration 60 --theta0-deg 3 --fast\n"
      "The last line of the output is the run directory.");
  const auto a = std::make_shared<RunArguments>();
  command.option("--rig", a->rig, "Rig file").required();
  command.option("--gains", a->gains, "Gain file").required();
  command.option(
      "--plant", a->plant,
      "Plant file of a real rig: the gains must stabilize it, and its delay margin limits overruns");
  command.option("--delay", a->delay_s, "Delay of the feedback [s] (default: delay_s of the gain file)")
      .in(Range::within(0.0, DelayLine::longest_delay_s));
  constexpr double longest_run_s = 1e6;
  command.option("--duration", a->duration_s, "Duration of the run [s] (default: 10)")
      .in({0.0, longest_run_s, true});
  command
      .option("--wait", a->wait_s,
              "Real rigs only: how long to wait at zero volts for the pendulum to be lifted upright [s] "
              "(default: 30)")
      .in(Range::within(0.0, 86400.0));
  command
      .option("--theta0-deg", a->theta0_deg,
              "Simulated rigs only: initial angle [degree], 0 is upright (default: that of the rig file)")
      .in(Range::within(-180.0, 180.0));
  add_simulated(command, a->seed, a->fast);
  command.option("--out", a->out, "Folder in which the run directory is created (default: runs)");
  command.option("--label", a->label, "Last part of the name of the run directory (default: run)");
  add_realtime(command, a->realtime);
  add_live(command, a->live_port);
  add_stream(command, a->stream);
  command.flag("--unchecked", a->unchecked, "Run a real rig without a sign check");
  command.flag("--force", a->force, "Run even if the gains do not stabilize the plant");
  command.flag("--json", a->as_json, "Print one JSON document");
  command.does([a] { return run(*a); });
}

}  // namespace upright::cli
