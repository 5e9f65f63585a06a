#include "upright/runtime/session.hpp"

#include <chrono>
#include <cmath>
#include <exception>
#include <future>
#include <optional>
#include <thread>

#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/cpu_latency.hpp"

namespace upright {

namespace {

using namespace std::chrono_literals;

constexpr double log_patience_s = 2.0;  // ordinary disks stand still for a second now and then

/// Whatever happens, the motor ends at zero volts.
class StopAtEnd {
 public:
  explicit StopAtEnd(Rig& rig) : rig_(rig) {}
  ~StopAtEnd() { rig_.stop(); }
  StopAtEnd(const StopAtEnd&) = delete;
  StopAtEnd& operator=(const StopAtEnd&) = delete;

 private:
  Rig& rig_;
};

/// Puts the predictor's plant file beside the log, so that the run replays wherever it is taken.
void keep_prediction_plant(const RunDirectory& directory, ControlConfig& control) {
  if (control.compensation.kind != CompensationKind::predictor) return;
  const std::filesystem::path name = "prediction_plant.yaml";
  write_plant_file(read_plant_file(control.compensation.plant), directory.path() / name);
  control.compensation.plant = name;
}

}  // namespace

std::uint64_t default_periods_late(double period_s) {
  constexpr double tolerated_s = 0.05;
  constexpr std::uint64_t at_least = 3;
  return std::max(at_least, static_cast<std::uint64_t>(std::ceil(tolerated_s / period_s)));
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
    throw DeviceError("release the emergency stop when it is safe: it is pressed, or its wire is cut");
  if (is_limit_switch(last_fault))
    throw DeviceError("bring the cart to the middle: a limit switch is active, or its wire is cut");
  throw DeviceError("check the encoders' link: no fresh counts came to take the zero from");
}

SessionResult run_session(RunSetup setup, Rig& rig, Clock& clock, const SignalFlag& signal,
                          SessionOptions options) {
  const StopAtEnd stop_at_end(rig);
  std::optional<CpuLatencyHold> awake;
  if (!clock.is_virtual()) awake.emplace();
  Controller controller(setup.control, setup.rig.amplifier.limit_v, std::move(options.compensator));
  controller.follow(options.source);
  PoseScaler scaler(calibration_in_use(setup.rig));
  RunDirectory directory(options.out, setup.label);
  keep_prediction_plant(directory, setup.control);
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
      directory.write_start(setup);
      const std::uint64_t faults_before = page_faults();
      loop.run(result.outcome);
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
  log.close();
  result.elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  result.scheduling = setup.scheduling;
  result.log = {log.rows_written(), log.rows_dropped(), log.failure()};
  if (log.failed() && result.outcome.reason == StopReason::duration)
    result.outcome.reason = StopReason::log_failed;
  result.outcome_written = directory.write_outcome(result.outcome, setup.limits, result.log);
  return result;
}

}  // namespace upright
