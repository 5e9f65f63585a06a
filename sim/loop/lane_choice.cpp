#include "event_lane.hpp"
#include "fast_loop.hpp"
#include "lane_builds.hpp"

namespace upright {

bool lanes_can_run(const LoopSetup& setup) {
  if (setup.make_parts || setup.model.cart_locked || !setup.model.has_pendulum) return false;
  const Dynamics<double> physics(setup.model);
  if (physics.has_motor_lag() || physics.pivot_has_kink()) return false;
  if (setup.sampled && physics.input_delay_s() > 0.0) return false;
  // Faster plants than that need steps that the lanes do not take.
  constexpr double fastest_radps = 1e3;
  return fastest_rate_radps(setup.model) < fastest_radps;
}

std::size_t runs_side_by_side(LaneRegisters registers) {
  return registers == LaneRegisters::wide ? wide_lanes::runs_side_by_side()
                                          : baseline_lanes::runs_side_by_side();
}

void run_on_lanes(const LoopSetup& setup, std::span<const LoopCase> cases, std::span<LoopResult> results,
                  LaneRegisters registers) {
  (registers == LaneRegisters::wide ? wide_lanes::run : baseline_lanes::run)(setup, cases, results);
}

}  // namespace upright
