// The sampled loop on SIMD lanes beside the event engine and Boost odeint: errors against a tight reference
// and milliseconds of CPU per run, in one go. tests/bench/sweep_bench.sh adds numba and scipy.
//
// Then the continuous loop with delay, on the lanes and on the event engine.
//
// Before that, the lanes of each kind of registers that this build and processor have (--registers: these
// only).
//
// 240 runs over starting angle and delay, 10 s each at 1 kHz, gain (7), velocity filter, no encoders (their
// steps make the loop chaotic, so that trajectories cannot be compared).
#include "sweep_bench.hpp"

#include <algorithm>
#include <boost/numeric/odeint.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "sim/loop/closed_loop.hpp"
#include "sweep/sweep.hpp"
#include "sweep/sweep_tasks.hpp"
#include "upright/control/model_parts.hpp"

namespace {

using namespace upright;

struct Rhs {
  const Dynamics<double>& dynamics;
  double motor_v;
  void operator()(const std::array<double, 4>& y, std::array<double, 4>& rate, double) const {
    const PlantState<double> d = dynamics.derivative({y[0], y[1], y[2], y[3]}, motor_v, {});
    rate = {d.cart_m, d.theta_rad, d.cart_mps, d.theta_radps};
  }
};

void tight(const Dynamics<double>& dynamics, double motor_v, std::array<double, 4>& state, double period_s) {
  const Rhs rhs{dynamics, motor_v};
  boost::numeric::odeint::runge_kutta4<std::array<double, 4>> stepper;
  constexpr int pieces = 64;
  for (int i = 0; i < pieces; ++i) stepper.do_step(rhs, state, 0.0, period_s / pieces);
}

void dopri5(const Dynamics<double>& dynamics, double motor_v, std::array<double, 4>& state, double period_s) {
  namespace odeint = boost::numeric::odeint;
  static thread_local auto stepper =
      odeint::make_controlled(1e-8, 1e-8, odeint::runge_kutta_dopri5<std::array<double, 4>>());
  odeint::integrate_adaptive(stepper, Rhs{dynamics, motor_v}, state, 0.0, period_s, period_s);
}

const std::vector<double> marks = {0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0};

/// Largest error of the lanes at the marks: the run is made anew for each of them.
double lane_error(LoopSetup setup, const std::vector<LoopCase>& cases,
                  const std::vector<std::vector<double>>& truth) {
  double worst = 0.0;
  std::vector<LoopResult> results(cases.size());
  for (std::size_t m = 0; m < marks.size(); ++m) {
    setup.duration_s = marks[m];
    run_on_lanes(setup, cases, results);
    for (std::size_t i = 0; i < cases.size(); ++i)
      worst = std::max(worst, std::abs(results[i].end.theta_rad - truth[i][m]));
  }
  return worst;
}

void smooth() {
  const LoopSetup setup = setup_for("exponential", 100.0);
  const std::vector<LoopCase> cases = cases_240();
  std::vector<std::vector<double>> truth;
  for (const LoopCase& start : cases) truth.push_back(run_loop(setup, start, marks, tight));
  double odeint_error = 0.0;
  double odeint_s = 0.0;
  for (std::size_t i = 0; i < cases.size(); i += 4) {
    const double begin = cpu_s();
    const std::vector<double> shown = run_loop(setup, cases[i], marks, dopri5);
    odeint_s += cpu_s() - begin;
    for (std::size_t m = 0; m < shown.size(); ++m)
      odeint_error = std::max(odeint_error, std::abs(shown[m] - truth[i][m]));
  }
  const double odeint_ms = 1e3 * odeint_s / static_cast<double>(cases.size() / 4);
  const double lanes = lanes_ms(setup, cases), events = events_ms(setup, cases);
  std::printf("smooth exponential friction, 240 runs of 10 s, sampled at 1 kHz, one core\n");
  std::printf("  lanes          %8.3f ms per run, error %.1e rad, %.0f runs per second\n", lanes,
              lane_error(setup, cases, truth), 1e3 / lanes);
  std::printf("  event engine   %8.3f ms per run (%.1f times the lanes)\n", events, events / lanes);
  std::printf("  Boost odeint   %8.3f ms per run (%.1f times the lanes), error %.1e rad\n", odeint_ms,
              odeint_ms / lanes, odeint_error);
  std::printf("LANES_MS %.6f\n", lanes);
}

void stick_slip() {
  const LoopSetup setup = setup_for("exponential", 0.0);
  const std::vector<LoopCase> cases = cases_240();
  const double lanes = lanes_ms(setup, cases), events = events_ms(setup, cases);
  std::printf("true stick-slip, the same runs\n  lanes          %8.3f ms per run\n", lanes);
  std::printf("  event engine   %8.3f ms per run (%.1f times the lanes)\n", events, events / lanes);
  const LoopSetup bristles = setup_for("dynamic", 0.0);
  std::printf("bristles, the same runs\n  lanes          %8.3f ms per run\n", lanes_ms(bristles, cases));
}

/// The velocity filter, and a Kalman filter that knows the viscous plant, with the same gains.
void estimating(const char* name, const std::string& plant, double smoothing) {
  LoopSetup setup = setup_for(plant, smoothing);
  setup.amplifier_limit_v = 15.0;
  const std::vector<LoopCase> cases = cases_240();
  const double filter = lanes_ms(setup, cases);
  setup.control.state_estimator.kind = StateEstimatorKind::kalman;
  setup.control.rejection.share = 1.0;
  setup.control.gains = {47.4, 120.0, 41.0, 22.8};
  const Plant believed = read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/viscous.yaml");
  setup.make_parts = [believed](const ControlConfig& asked) {
    return make_model_parts(asked, believed, believed);
  };
  const double estimated = lanes_ms(setup, cases), events = events_ms(setup, cases);
  std::printf("Kalman filter, %s\n", name);
  std::printf("  lanes          %8.3f ms per run (%.2f times the velocity filter's %.3f)\n", estimated,
              estimated / filter, filter);
  std::printf("  event engine   %8.3f ms per run (%.1f times the lanes)\n", events, events / estimated);
}

/// The continuous loop, V(t) = gains . state(t - delay). Its truth is the event engine with steps of 50 us.
void continuous(const char* name, const std::string& plant, double smoothing) {
  LoopSetup setup = setup_for(plant, smoothing);
  setup.sampled = false;
  const std::vector<LoopCase> cases = cases_240();
  const std::vector<double> early = {0.1, 0.25, 0.5, 1.0, 2.0};
  EngineOptions tight_steps;
  tight_steps.max_step_s = 5e-5;
  const Gains& g = setup.control.gains;
  std::vector<std::vector<double>> truth(cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) {
    ContinuousLoop<EventEngine<double>> loop(setup.model,
                                             {g.cart_position_v_per_m, g.pendulum_angle_v_per_rad,
                                              g.cart_velocity_v_per_mps, g.pendulum_rate_v_per_radps},
                                             cases[i].delay_s, tight_steps);
    PlantState<double> state;
    state.theta_rad = cases[i].theta0_rad;
    loop.start(state);
    for (const double mark : early) {
      loop.advance_to(mark);
      truth[i].push_back(loop.engine().state().theta_rad);
    }
  }
  double error = 0.0;
  std::vector<LoopResult> results(cases.size());
  for (std::size_t m = 0; m < early.size(); ++m) {
    setup.duration_s = early[m];
    run_on_lanes(setup, cases, results);
    for (std::size_t i = 0; i < cases.size(); ++i)
      error = std::max(error, std::abs(results[i].end.theta_rad - truth[i][m]));
  }
  setup.duration_s = 10.0;
  const auto best_ms = [&](const std::vector<LoopCase>& runs) {
    double best = 1e300;
    for (int repeat = 0; repeat < 7; ++repeat) {
      const double begin = cpu_s();
      run_on_lanes(setup, runs, results);
      best = std::min(best, cpu_s() - begin);
    }
    return 1e3 * best / static_cast<double>(runs.size());
  };
  std::vector<LoopCase> at_15_ms = cases;
  for (LoopCase& start : at_15_ms) start.delay_s = 0.015;
  const double spread = best_ms(cases), one = best_ms(at_15_ms), events = events_ms(setup, at_15_ms);
  std::printf("continuous delay, %s\n", name);
  std::printf("  lanes          %8.3f ms per run at delays of 0 to 14 ms, error %.1e rad\n", spread, error);
  std::printf("  lanes          %8.3f ms per run at 15 ms, %.0f runs per second\n", one, 1e3 / one);
  std::printf("  event engine   %8.3f ms per run at 15 ms (%.1f times the lanes)\n", events, events / one);
}

/// One core against two, by the clock on the wall; disturbed by whatever else runs.
void cores() {
  SweepConfig config;
  config.setup = setup_for("exponential", 100.0);
  std::vector<SweepNumbers> tasks;
  const std::size_t together = runs_side_by_side();
  const std::vector<LoopCase> cases = cases_240();
  for (std::size_t first = 0; first < cases.size(); first += together)
    for (int repeat = 0; repeat < 12; ++repeat)
      tasks.push_back(plain_task(std::span(cases).subspan(first, together)));
  // In turn, and the best of each: other work on the machine disturbs some of them.
  double best_s[2] = {1e300, 1e300};
  for (int repeat = 0; repeat < 9; ++repeat) {
    for (const unsigned threads : {1u, 2u}) {
      const auto begin = std::chrono::steady_clock::now();
      make_thread_executor(config, threads)
          ->run(
              tasks.size(), [&](std::size_t task) { return tasks[task]; },
              [](std::size_t, const SweepNumbers&) {}, nullptr);
      const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
      best_s[threads - 1] = std::min(best_s[threads - 1], wall.count());
    }
  }
  std::printf("two threads    %8.2f times one (the best of 9 each)\n", best_s[0] / best_s[1]);
}

}  // namespace

int main(int argc, char** argv) {
  bench_registers();
  if (argc > 1 && std::string(argv[1]) == "--registers") return 0;
  smooth();
  stick_slip();
  estimating("smooth exponential friction", "exponential", 100.0);
  estimating("bristles", "dynamic", 0.0);
  bench_as_the_rig_is();
  continuous("smooth exponential friction", "exponential", 100.0);
  continuous("exponential friction, true stick-slip", "exponential", 0.0);
  continuous("bristles", "dynamic", 0.0);
  cores();
}
