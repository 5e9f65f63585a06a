// What the parts of sweep_bench share: the loops, the runs, and the clock.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include "sim/loop/fast_loop.hpp"
#include "upright/control/controller.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

inline double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

inline LoopSetup setup_for(const std::string& plant, double smoothing) {
  LoopSetup setup;
  setup.model = make_model<double>(
      read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + plant + ".yaml"));
  setup.model.smoothing = smoothing;
  setup.control.gains = {70.7107, 304.9273, 143.3152, 61.0833};
  setup.sampled = true;
  setup.duration_s = 10.0;
  return setup;
}

/// As the rig is.
inline LoopSetup rig_loop(const std::string& plant) {
  LoopSetup setup = setup_for(plant, 0.0);
  setup.amplifier_limit_v = 15.0;
  setup.cart_resolution_m = 2.27485e-5;
  setup.angle_resolution_rad = 1.5339808e-3;
  return setup;
}

/// With controllers that know the viscous plant.
inline LoopSetup with_models(LoopSetup setup, bool estimates, bool predicts) {
  setup.control.gains = {47.4, 120.0, 41.0, 22.8};
  if (estimates) setup.control.state_estimator.kind = StateEstimatorKind::kalman;
  if (predicts) setup.control.compensation.kind = CompensationKind::predictor;
  const Plant believed = read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/viscous.yaml");
  setup.make_parts = [believed](const ControlConfig& asked) {
    return make_model_parts(asked, believed, believed);
  };
  return setup;
}

/// Delays up to 14 ms, under which no start falls.
inline std::vector<LoopCase> cases_240() {
  std::vector<LoopCase> cases;
  for (int delay_ms = 0; delay_ms < 15; ++delay_ms)
    for (int i = 0; i < 16; ++i) cases.push_back({0.005 + 0.003 * i, 1e-3 * delay_ms});
  return cases;
}

inline double stepped(double value, double resolution) {
  return resolution > 0.0 ? std::nearbyint(value / resolution) * resolution : value;
}

/// The loop around any way of crossing one period; `cross(dynamics, motor_v, state, period)`. Snapshots at
/// `marks`.
template <class Cross>
std::vector<double> run_loop(const LoopSetup& setup, const LoopCase& start, const std::vector<double>& marks,
                             Cross&& cross) {
  const Dynamics<double> dynamics(setup.model);
  ControlConfig control = setup.control;
  control.delay_s = start.delay_s;
  Controller controller(control, setup.amplifier_limit_v);
  std::array<double, 4> state{0.0, start.theta0_rad, 0.0, 0.0};
  std::vector<double> shown;
  const double period_s = control.period_s();
  const auto ticks = static_cast<std::uint64_t>(std::llround(setup.duration_s / period_s));
  std::size_t mark = 0;
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    ControlInput input;
    input.tick = tick;
    input.cart_m = stepped(state[0], setup.cart_resolution_m);
    input.theta_rad = stepped(state[1], setup.angle_resolution_rad);
    cross(dynamics, dynamics.actuate(controller.step(input).voltage_v), state, period_s);
    if (mark < marks.size() && static_cast<double>(tick + 1) * period_s >= marks[mark] - 1e-9) {
      shown.push_back(state[1]);
      ++mark;
    }
  }
  return shown;
}

inline double lanes_ms(const LoopSetup& setup, const std::vector<LoopCase>& cases) {
  std::vector<LoopResult> results(cases.size());
  double best = 1e300;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const double begin = cpu_s();
    run_on_lanes(setup, cases, results);
    best = std::min(best, cpu_s() - begin);
  }
  return 1e3 * best / static_cast<double>(cases.size());
}

inline double events_ms(const LoopSetup& setup, const std::vector<LoopCase>& cases) {
  const double begin = cpu_s();
  for (std::size_t i = 0; i < cases.size(); i += 4) run_with_events(setup, cases[i]);
  return 1e3 * (cpu_s() - begin) / static_cast<double>(cases.size() / 4);
}

/// Each kind of loop on each kind of registers, and lanes that are refilled. To be called before any lanes
/// have run in this process.
void bench_registers();

/// The loop as the rig is, beside Boost odeint with events.
void bench_as_the_rig_is();

}  // namespace upright
