#include "upright/runtime/replay.hpp"

#include <bit>
#include <cmath>

namespace upright {

namespace {

bool same(double a, double b) {
  // The text of a NaN does not hold its bits.
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

}  // namespace

ReplayResult replay(const RunRecord& run, std::unique_ptr<DelayCompensator> compensator,
                    CommandSource* source) {
  Controller controller(run.control, run.rig.amplifier.limit_v, std::move(compensator));
  controller.follow(source);
  PoseScaler scaler(calibration_in_use(run.rig));
  ReplayResult result;
  bool begun = false;
  double requested_v = 0.0, held_v = 0.0;
  std::uint64_t next_tick = 0;
  for (const LogRecord& row : run.samples.rows) {
    if (row.tick != next_tick && (row.flags & row_flag::missed) == 0 && !result.first_lost_tick)
      result.first_lost_tick = row.tick;
    next_tick = row.tick + 1;
    if ((row.flags & row_flag::held) == 0) {
      Pose pose = scaler.scale(row.cart_counts, row.pendulum_counts);
      if (!begun) pose = scaler.nearest_turn();
      begun = true;
      const ControlOutput output = controller.step({row.tick, pose.cart_m, pose.theta_rad, 0.0});
      requested_v = output.voltage_requested_v;
      held_v = output.voltage_v;
    }
    const double applied_v = (row.flags & row_flag::stopped) != 0 ? 0.0 : held_v;
    ++result.rows;
    if (same(requested_v, row.voltage_requested_v) && same(applied_v, row.voltage_v)) continue;
    result.first_mismatch = {row.tick, row.voltage_requested_v, requested_v, row.voltage_v, applied_v};
    return result;
  }
  return result;
}

}  // namespace upright
