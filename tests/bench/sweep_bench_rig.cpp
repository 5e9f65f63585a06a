// The sampled loop as the rig is: encoder steps, an amplifier of 15 V, true stick-slip or bristles, with the
// velocity filter, the Kalman filter and a predictor of 100 periods; beside the event engine and Boost odeint
// with events.
#include <boost/numeric/odeint.hpp>
#include <cstdio>

#include "sim/loop/loop_run.hpp"
#include "sweep_bench.hpp"

namespace upright {

namespace {

namespace odeint = boost::numeric::odeint;
using State = std::array<double, 4>;

/// Dormand and Prince's 5(4) pair with dense output, restarted at each stop and breakaway, which bisection
/// finds.
class StickSlipPeriod {
 public:
  void operator()(const Dynamics<double>& dynamics, double motor_v, State& y, double period_s) {
    double now_s = 0.0;
    settle(dynamics, motor_v, y);
    while (now_s < period_s) {
      const auto rate = [&](const State& at, State& out, double) {
        const PlantState<double> d =
            dynamics.derivative(plant_state(at), motor_v, {contact_, Contact::slip_forward});
        out = {d.cart_m, d.theta_rad, d.cart_mps, d.theta_radps};
      };
      auto stepper = odeint::make_dense_output(1e-8, 1e-8, odeint::runge_kutta_dopri5<State>());
      stepper.initialize(y, now_s, period_s - now_s);
      now_s = until_event(stepper, rate, dynamics, motor_v, y, period_s);
    }
  }

 private:
  static PlantState<double> plant_state(const State& y) { return {y[0], y[1], y[2], y[3]}; }

  /// Positive beyond a stop or a breakaway.
  double passed(const Dynamics<double>& dynamics, double motor_v, const State& y) const {
    if (contact_ != Contact::stick) return -static_cast<double>(contact_) * y[2];
    const double load = dynamics.cart_load(plant_state(y), motor_v, Contact::slip_forward);
    return std::max(load - dynamics.cart_dry_level(y[0], 0.0, 1.0),
                    -load - dynamics.cart_dry_level(y[0], 0.0, -1.0));
  }

  void settle(const Dynamics<double>& dynamics, double motor_v, const State& y) {
    contact_ = y[2] > 0.0 ? Contact::slip_forward : y[2] < 0.0 ? Contact::slip_backward : Contact::stick;
    if (contact_ == Contact::stick && passed(dynamics, motor_v, y) > 0.0) break_away(dynamics, motor_v, y);
  }
  void break_away(const Dynamics<double>& dynamics, double motor_v, const State& y) {
    const double load = dynamics.cart_load(plant_state(y), motor_v, Contact::slip_forward);
    contact_ = load > 0.0 ? Contact::slip_forward : Contact::slip_backward;
  }

  /// Steps to the next event or the end of the period; returns when that is.
  template <class Stepper, class Rate>
  double until_event(Stepper& stepper, const Rate& rate, const Dynamics<double>& dynamics, double motor_v,
                     State& y, double period_s) {
    for (;;) {
      const auto [from_s, to_s] = stepper.do_step(rate);
      double high_s = std::min(to_s, period_s), low_s = from_s;
      stepper.calc_state(high_s, y);
      if (!(passed(dynamics, motor_v, y) > 0.0)) {
        if (high_s == period_s) return period_s;
        continue;
      }
      constexpr double near_s = 1e-12;
      while (high_s - low_s > near_s) {
        const double middle_s = 0.5 * (low_s + high_s);
        stepper.calc_state(middle_s, y);
        (passed(dynamics, motor_v, y) > 0.0 ? high_s : low_s) = middle_s;
      }
      stepper.calc_state(high_s, y);
      if (contact_ == Contact::stick) {
        break_away(dynamics, motor_v, y);
      } else {
        y[2] = 0.0;
        settle(dynamics, motor_v, y);
      }
      return high_s;
    }
  }

  Contact contact_ = Contact::stick;
};

/// Bristles: no events; the control of the step finds the reversals.
double bristles_odeint_ms(const LoopSetup& setup, const LoopCase& start) {
  using Five = std::array<double, 5>;
  double bristle_m = 0.0;
  auto stepper = odeint::make_controlled(1e-8, 1e-8, odeint::runge_kutta_dopri5<Five>());
  const double begin = cpu_s();
  run_loop(setup, start, {},
           [&](const Dynamics<double>& dynamics, double motor_v, State& y, double period_s) {
             const auto rate = [&](const Five& at, Five& out, double) {
               const PlantState<double> d =
                   dynamics.derivative({at[0], at[1], at[2], at[3], 0.0, at[4]}, motor_v, {});
               out = {d.cart_m, d.theta_rad, d.cart_mps, d.theta_radps, d.bristle_m};
             };
             Five all{y[0], y[1], y[2], y[3], bristle_m};
             odeint::integrate_adaptive(stepper, rate, all, 0.0, period_s, period_s);
             std::copy_n(all.begin(), y.size(), y.begin());
             bristle_m = all[4];
           });
  return 1e3 * (cpu_s() - begin);
}

double odeint_ms(const LoopSetup& setup, const std::vector<LoopCase>& cases, bool bristles) {
  double sum_ms = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < cases.size(); i += 12, ++count) {
    if (bristles) {
      sum_ms += bristles_odeint_ms(setup, cases[i]);
      continue;
    }
    const double begin = cpu_s();
    run_loop(setup, cases[i], {}, StickSlipPeriod());
    sum_ms += 1e3 * (cpu_s() - begin);
  }
  return sum_ms / count;
}

void row(const char* what, double ms, double lanes, const char* of = "the lanes") {
  std::printf("  %-32s %8.3f ms per run (%.2f times %s)\n", what, ms, ms / lanes, of);
}

void rig_rows(const char* name, const std::string& plant, double smooth_ms) {
  const LoopSetup setup = rig_loop(plant);
  const std::vector<LoopCase> cases = cases_240();
  std::vector<LoopCase> late = cases;
  for (LoopCase& one : late) one.delay_s = 0.1;
  const double lanes = lanes_ms(setup, cases);
  std::printf("as the rig is (encoders, 15 V), %s\n", name);
  row("lanes", lanes, smooth_ms, "the smooth loop");
  row("event engine", events_ms(setup, cases), lanes);
  row("Boost odeint", odeint_ms(setup, cases, plant == "dynamic"), lanes);
  row("lanes, Kalman filter", lanes_ms(with_models(setup, true, false), cases), lanes, "the filter's");
  row("lanes, predictor, 100 periods", lanes_ms(with_models(setup, false, true), late), lanes, "without");
  const double both = lanes_ms(with_models(setup, true, true), late);
  row("lanes, both", both, lanes, "without");
  row("event engine, both", events_ms(with_models(setup, true, true), late), both, "the lanes with both");
  if (plant == "exponential") std::printf("RIG_MS %.6f\n", lanes);
}

/// With one more effect, which takes more of a period: a second contact, or a lagging motor.
void effect_rows(const std::string& plant, const char* effect, double number, double smooth_ms) {
  LoopSetup setup = rig_loop(plant);
  const double without = lanes_ms(setup, cases_240());
  Plant more = read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + plant + ".yaml");
  more.set(effect, {number});
  setup.model = make_model<double>(more);
  const double lanes = lanes_ms(setup, cases_240());
  std::printf("as the rig is, %s with %s\n", plant.c_str(), effect);
  row("lanes", lanes, smooth_ms, "the smooth loop");
  row("lanes", lanes, without, "without this effect");
  row("event engine", events_ms(setup, cases_240()), lanes);
}

}  // namespace

void bench_as_the_rig_is() {
  const double smooth_ms = lanes_ms(setup_for("exponential", 100.0), cases_240());
  rig_rows("exponential friction, true stick-slip", "exponential", smooth_ms);
  rig_rows("bristles", "dynamic", smooth_ms);
  for (const char* plant : {"exponential", "dynamic"}) {
    effect_rows(plant, "pivot_coulomb_friction", 0.003, smooth_ms);
    effect_rows(plant, "motor_lag", 0.001, smooth_ms);
  }
}

}  // namespace upright
