#include "upright/record/replay.hpp"

#include <bit>
#include <cmath>
#include <string>
#include <utility>

#include "upright/control/controller.hpp"

namespace upright {

namespace {

bool same(double a, double b) {
  // The text of a NaN does not hold its bits.
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

/// Takes rows in their order.
class Replayer {
 public:
  Replayer(const RunRecord& run, ModelParts parts, CommandSource* source)
      : controller_(run.control, run.rig.amplifier.limit_v, std::move(parts)),
        scaler_(calibration_in_use(run.rig)) {
    controller_.follow(source);
  }

  /// False from the first mismatch on.
  bool take(const LogRecord& row) {
    if (row.tick != next_tick_ && (row.flags & row_flag::missed) == 0 && !result_.first_lost_tick)
      result_.first_lost_tick = row.tick;
    next_tick_ = row.tick + 1;
    if ((row.flags & row_flag::held) == 0) compute(row);
    const double applied_v = (row.flags & row_flag::stopped) != 0 ? 0.0 : held_v_;
    ++result_.rows;
    if (same(requested_v_, row.voltage_requested_v) && same(applied_v, row.voltage_v)) return true;
    result_.first_mismatch = {row.tick, row.voltage_requested_v, requested_v_, row.voltage_v, applied_v};
    return false;
  }

  const ReplayResult& result() const { return result_; }

 private:
  void compute(const LogRecord& row) {
    Pose pose = scaler_.scale(row.cart_counts, row.pendulum_counts);
    if (!begun_) pose = scaler_.nearest_turn();
    begun_ = true;
    // Velocities that the device measured are the logged ones; what was estimated is estimated again.
    const ControlOutput output = controller_.step(
        {row.tick, pose.cart_m, pose.theta_rad, 0.0, row.cart_velocity_mps, row.pendulum_rate_radps});
    requested_v_ = output.voltage_requested_v;
    held_v_ = output.voltage_v;
  }

  Controller controller_;
  PoseScaler scaler_;
  ReplayResult result_;
  bool begun_ = false;
  double requested_v_ = 0.0, held_v_ = 0.0;
  std::uint64_t next_tick_ = 0;
};

}  // namespace

ReplayResult replay(const RunRecord& run, ModelParts parts, CommandSource* source) {
  Replayer replayer(run, std::move(parts), source);
  for (const LogRecord& row : run.samples.rows)
    if (!replayer.take(row)) break;
  return replayer.result();
}

ReplayResult replay(const RunRecord& run, SampleReader& rows, ModelParts parts, CommandSource* source,
                    const ProgressCallback& progress) {
  constexpr std::uint64_t rows_between_reports = 16384;
  Replayer replayer(run, std::move(parts), source);
  for (LogRecord row; rows.next(row) && replayer.take(row); row = {}) {
    const std::uint64_t done = replayer.result().rows;
    if (progress && done % rows_between_reports == 0)
      progress(rows.share_read(), std::to_string(done) + " rows");
  }
  return replayer.result();
}

}  // namespace upright
