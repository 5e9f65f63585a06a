#include "upright/runtime/session.hpp"

#include <chrono>
#include <cmath>
#include <exception>
#include <future>
#include <optional>
#include <thread>

#include "control_loop.hpp"
#include "cpu_latency.hpp"
#include "realtime.hpp"
#include "record/run_log.hpp"
#include "record/sign_record.hpp"
#include "record/stop_report.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/control/controller.hpp"
#include "upright/model/plant_file.hpp"
#include "zero_volts.hpp"

namespace upright {

namespace {

using namespace std::chrono_literals;

constexpr double log_patience_s = 2.0;  // ordinary disks stand still for a second now and then

/// Puts the controller's plant files beside the log, so that the run replays wherever it is taken.
void keep_plants(const RunDirectory& directory, ControlConfig& control) {
  const auto keep = [&](std::filesystem::path& plant, const char* name) {
    write_plant_file(read_plant_file(plant), directory.path() / name);
    plant = name;
  };
  if (control.compensation.kind == CompensationKind::predictor)
    keep(control.compensation.plant, "prediction_plant.yaml");
  if (control.has_state_estimator()) keep(control.state_estimator.plant, "estimation_plant.yaml");
}

/// Writes the outcome. A run whose rows or outcome were not kept is not a completed one.
void complete(RunDirectory& directory, const LoopLimits& limits, SessionResult& result) {
  StopReason& reason = result.outcome.reason;
  if (!result.log.failure.empty() && reason == StopReason::duration) reason = StopReason::log_failed;
  result.outcome_written = directory.write_outcome(result.outcome, limits, result.log);
  result.made_at = directory.path();
  result.directory = directory.path_now();
  if (result.outcome_written && !result.directory.empty()) return;
  if (reason == StopReason::duration) reason = StopReason::log_failed;
  if (result.log.failure.empty())
    result.log.failure =
        result.directory.empty()
            ? "the run directory " + directory.path().string() +
                  " was removed during the run, so its rows are lost: do not change it before "
                  "the run has ended"
            : (result.directory / "run.yaml").string() +
                  " could not be completed: free space on the disk of the run directory";
  if (result.directory.empty()) result.directory = directory.path();
}

}  // namespace

std::uint64_t default_periods_late(double period_s) {
  constexpr double tolerated_s = 0.05;
  constexpr std::uint64_t min_periods = 3;
  return std::max(min_periods, static_cast<std::uint64_t>(std::ceil(tolerated_s / period_s)));
}

void require_spin_fits(double spin_us, double period_s) {
  // A loop of real-time priority leaves the other half of its processor to the kernel and to everybody else.
  constexpr double largest_share = 0.5;
  if (1e-6 * spin_us <= largest_share * period_s) return;
  throw ConfigError("the loop would busy-wait for " + exact_text(spin_us) + " us of each period of " +
                    exact_text(period_s) +
                    " s, which is more than half of it: reduce spin_us in the rig file (or --spin), or lower "
                    "sample_rate_hz in the gain file");
}

void require_velocities(const ControlConfig& control, bool rig_measures_them) {
  const bool asks = !control.has_state_estimator() && control.estimator.kind == EstimatorKind::device;
  if (!asks || rig_measures_them) return;
  throw ConfigError(
      "velocity_estimator.kind of the gain file is device, but this rig measures no velocities: use "
      "second_order_filter, or a card that measures them (quanser_hil.encoder_velocities)");
}

std::string gap_of_encoder_watch(const RigFile& rig) {
  const std::vector<std::string> missing =
      missing_assumptions(rig.encoder_watch.value_or(StatedAssumptions{}));
  if (missing.empty()) return "";
  std::string keys;
  for (const std::string& key : missing) keys += (keys.empty() ? "" : ", ") + key;
  return rig.file.string() + ": encoder_watch does not state " + keys +
         ", so the watch assumes an IP02: for another plant add them to the rig file, or name its plant file "
         "with --plant";
}

LoopLimits rig_limits(const RigFile& rig, const std::optional<Plant>& plant) {
  LoopLimits limits;
  limits.track_limit_m = rig.track_limit_m;
  limits.fall_angle_rad = rig.fall_angle_rad;
  limits.watchdog_s = rig.watchdog_s;
  limits.coast_s = rig.coast_s;
  limits.signs_unproven = !is_simulated(rig) && !signs_are_checked(rig);
  const StatedAssumptions stated = rig.encoder_watch.value_or(StatedAssumptions{});
  if (plant) {
    limits.encoders = widened(encoder_assumptions(*plant, rig.track_limit_m, rig.amplifier.limit_v), stated);
  } else {
    limits.encoders = encoder_assumptions(stated, rig.track_limit_m);
  }
  return limits;
}

void find_zero(Rig& rig, Clock& clock, RigFile& file, double patience_s) {
  if (!file.calibration.zero_at_start) return;
  if (is_simulated(file)) {
    // Its counters are zero at the pose that the zero names, wherever it starts.
    file.calibration.zero_at_start = false;
    return;
  }
  constexpr std::int64_t pause_ns = 1'000'000;
  const std::int64_t until_ns = clock.now_ns() + static_cast<std::int64_t>(patience_s * 1e9);
  RigFault last_fault = RigFault::none;
  for (;;) {
    const RigReading reading = rig.read();
    last_fault = reading.fault;
    if (reading.status == RigStatus::fresh) {
      file.calibration.cart_zero_counts = reading.cart_counts;
      file.calibration.pendulum_zero_counts = reading.pendulum_counts;
      file.calibration.zero_at_start = false;
      return;
    }
    const std::int64_t now_ns = clock.now_ns();
    if (now_ns > until_ns) break;
    clock.sleep_until(now_ns + pause_ns);
  }
  if (is_emergency_stop(last_fault))
    throw DeviceError("the emergency stop is pressed or its wire is broken: release it when it is safe");
  if (is_limit_switch(last_fault))
    throw DeviceError("a limit switch is active or its wire is broken: move the cart to the middle");
  throw DeviceError(
      "the zero cannot be set because no new encoder counts arrived: check the link to the encoders");
}

namespace {

/// The spin asked for, or the rig file's, into the rig and the limits that the run is logged with. A loop
/// that follows a device does not know when the wait ends.
void set_spin(RunSetup& setup, const Rig& rig, const RealtimeRequest& request) {
  setup.rig.spin_us = request.spin_us.value_or(setup.rig.spin_us);
  require_spin_fits(setup.rig.spin_us, setup.control.period_s());
  setup.limits.spin_ns = rig.is_clock() ? 0 : std::llround(1e3 * setup.rig.spin_us);
}

/// Where the loop waits, and how.
std::string waiting_note(const Rig& rig, const RunSetup& setup) {
  if (rig.is_clock()) return ", on the clock of the rig's device";
  if (setup.limits.spin_ns == 0) return "";
  return ", awake for the last " + exact_text(setup.rig.spin_us) + " us of each wait";
}

/// Everything but the rig's stop where it throws.
SessionResult run_to_its_stop(RunSetup setup, Rig& rig, Clock& clock, const SignalFlag& signal,
                              SessionOptions options) {
  set_spin(setup, rig, options.realtime);
  require_velocities(setup.control, rig.measures_velocities());
  std::optional<CpuLatencyHold> awake;
  if (!clock.is_virtual()) awake.emplace();
  Controller controller(setup.control, setup.rig.amplifier.limit_v, std::move(options.parts));
  controller.follow(options.source);
  PoseScaler scaler(calibration_in_use(setup.rig));
  setup.device = rig.device_facts();
  RunDirectory directory(options.out, setup.label);
  keep_plants(directory, setup.control);
  RunLog::Options log_options;
  log_options.sync_while_running = !clock.is_virtual();
  log_options.queue_rows = options.log_queue_rows;
  log_options.watcher = options.watcher;
  log_options.stall_rows =
      static_cast<std::size_t>(std::ceil(log_patience_s / controller.config().period_s()));
  RunLog log(directory.samples(), log_options);
  LiveStatus live;
  ControlLoop loop(rig, clock, controller, scaler, log, setup.limits, signal, live);

  SessionResult result;
  result.directory = directory.path();
  const auto started = std::chrono::steady_clock::now();
  std::promise<void> finished;
  std::future<void> over = finished.get_future();
  std::thread thread([&] {
    try {
      if (!clock.is_virtual()) setup.scheduling = enter_realtime(options.realtime);
      if (awake && awake->held()) setup.scheduling.note += ", processors kept out of deep sleep";
      if (!clock.is_virtual()) setup.scheduling.note += waiting_note(rig, setup);
      directory.write_start(setup);
      const std::uint64_t faults_before = page_faults();
      loop.run(result.outcome);
      result.outcome.realtime = setup.scheduling.policy == "SCHED_FIFO";
      result.outcome.counts.page_faults = page_faults() - faults_before;
      finished.set_value();
    } catch (...) {
      finished.set_exception(std::current_exception());
    }
  });
  while (over.wait_for(200ms) != std::future_status::ready)
    if (options.show) options.show(live);
  thread.join();
  over.get();
  if (!result.outcome.stop.done()) result.outcome.stop = stop_and_wait(rig, clock, options.stop);
  log.close();
  result.elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  result.scheduling = setup.scheduling;
  result.log = {log.rows_written(), log.rows_dropped(), log.failure()};
  complete(directory, setup.limits, result);
  return result;
}

}  // namespace

SessionResult run_session(RunSetup setup, Rig& rig, Clock& clock, const SignalFlag& signal,
                          SessionOptions options) {
  const StopWatcher watcher = options.stop;
  try {
    return run_to_its_stop(std::move(setup), rig, clock, signal, std::move(options));
  } catch (const std::exception& problem) {
    const StopReport report = stop_and_wait(rig, clock, watcher);
    if (report.done()) throw;
    throw DeviceError(sentence_of(report) + "; before that: " + problem.what());
  }
}

}  // namespace upright
