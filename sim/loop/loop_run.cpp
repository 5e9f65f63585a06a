#include "loop_run.hpp"

#include <algorithm>
#include <cmath>

#include "closed_loop.hpp"
#include "sim/cvode_engine.hpp"

namespace upright {

namespace {

FeedbackGains feedback_of(const Gains& gains) {
  return {gains.cart_position_v_per_m, gains.pendulum_angle_v_per_rad, gains.cart_velocity_v_per_mps,
          gains.pendulum_rate_v_per_radps};
}

double stepped(double value, double resolution) {
  return resolution > 0.0 ? std::nearbyint(value / resolution) * resolution : value;
}

PlantState<double> released_at(double theta_rad) {
  PlantState<double> state;
  state.theta_rad = theta_rad;
  return state;
}

/// What a run looks like from outside while it goes on.
class Watcher {
 public:
  Watcher(const LoopSetup& setup, const LoopObserver& observer)
      : sampled_(setup.sampled),
        window_begin_s_(setup.window_begin_s()),
        range_(window_begin_s_),
        observer_(observer) {}

  void take(double time_s, const PlantState<double>& state, double voltage_v) {
    range_.take(time_s, state.theta_rad, state.cart_m);
    if (time_s >= window_begin_s_) {
      squares_v2_ += voltage_v * voltage_v;
      periods_ += 1.0;
    }
    if (observer_) observer_(time_s, state, voltage_v);
  }

  template <class Engine>
  LoopResult finish(const Engine& engine) const {
    LoopResult result;
    const bool finite = std::isfinite(engine.state().theta_rad) && std::isfinite(engine.state().cart_m);
    if (engine.halted() || !finite) result.fall_time_s = engine.time_s();
    range_.into(result);
    if (sampled_ && !result.fell()) result.voltage_rms_v = std::sqrt(squares_v2_ / periods_);
    result.end = engine.state();
    return result;
  }

 private:
  bool sampled_;
  double window_begin_s_;
  double squares_v2_ = 0.0, periods_ = 0.0;  ///< of the window
  MotionRange range_;
  const LoopObserver& observer_;
};

EngineOptions options_of(const LoopSetup& setup) {
  EngineOptions options;
  options.fall_angle_rad = setup.fell_above_rad;
  return options;
}

template <class Engine>
LoopResult run_sampled(const LoopSetup& setup, const LoopCase& start, const LoopObserver& observer) {
  ControlConfig control = setup.control;
  control.delay_s = start.delay_s;
  Controller controller(control, setup.amplifier_limit_v,
                        setup.make_parts ? setup.make_parts(control) : ModelParts{});
  SampledLoop<Engine> loop(setup.model, control.sample_rate_hz, options_of(setup));
  const auto law = [&](std::uint64_t tick, const Measured& measured) {
    ControlInput input;
    input.tick = tick;
    input.cart_m = stepped(measured[0], setup.cart_resolution_m);
    input.theta_rad = stepped(measured[1], setup.angle_resolution_rad);
    return controller.step(input).voltage_v;
  };
  Watcher watcher(setup, observer);
  const auto ticks = static_cast<std::uint64_t>(std::llround(setup.duration_s * control.sample_rate_hz));
  loop.start(released_at(start.theta0_rad));
  watcher.take(0.0, loop.engine().state(), 0.0);
  while (loop.tick() < ticks && !loop.engine().halted()) {
    loop.step(law);
    watcher.take(loop.engine().time_s(), loop.engine().state(), loop.voltage_v());
  }
  return watcher.finish(loop.engine());
}

template <class Engine>
LoopResult run_continuous(const LoopSetup& setup, const LoopCase& start, const LoopObserver& observer) {
  // Often enough that the extremes are seen to 1e-4 of the amplitude at the frequencies of this loop.
  constexpr double slice_s = 2e-3;
  ContinuousLoop<Engine> loop(setup.model, feedback_of(setup.control.gains), start.delay_s,
                              options_of(setup));
  Watcher watcher(setup, observer);
  loop.start(released_at(start.theta0_rad));
  watcher.take(0.0, loop.engine().state(), loop.voltage_v());
  const auto slices = static_cast<std::uint64_t>(std::ceil(setup.duration_s / slice_s - 1e-9));
  for (std::uint64_t i = 1; i <= slices && !loop.engine().halted(); ++i) {
    loop.advance_to(std::min(setup.duration_s, static_cast<double>(i) * slice_s));
    watcher.take(loop.engine().time_s(), loop.engine().state(), loop.voltage_v());
    if (!std::isfinite(loop.engine().state().theta_rad)) break;
  }
  return watcher.finish(loop.engine());
}

}  // namespace

LoopResult run_with_events(const LoopSetup& setup, const LoopCase& start, const LoopObserver& observer) {
  return setup.sampled ? run_sampled<EventEngine<double>>(setup, start, observer)
                       : run_continuous<EventEngine<double>>(setup, start, observer);
}

LoopResult run_with_reference(const LoopSetup& setup, const LoopCase& start, const LoopObserver& observer) {
  return setup.sampled ? run_sampled<CvodeEngine>(setup, start, observer)
                       : run_continuous<CvodeEngine>(setup, start, observer);
}

}  // namespace upright
