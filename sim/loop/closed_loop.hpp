// A plant with state feedback, on any engine (EventEngine<double>, CvodeEngine): sampled with a held
// voltage, or continuous with a delay, V(t) = gains . y(t - delay). BasicSimulator is the open loop.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <vector>

#include "upright/sim/simulator.hpp"

namespace upright {

/// [x, theta, x_dot, theta_dot] as output by the plant's sensors (scales and offsets; no quantisation).
using Measured = std::array<double, 4>;
/// Volts per unit of `Measured`, in the order of the gain file.
using FeedbackGains = std::array<double, 4>;

/// The sensors' outputs as a linear function of the state, with a rigid drive and an encoder that runs true;
/// computed once.
class MeasuredState {
 public:
  explicit MeasuredState(const Dynamics<double>& dynamics) : line_(dynamics.model()) {}

  Measured operator()(const PlantState<double>& s) const {
    return {line_.cart_gain * s.cart_m + line_.cart_offset_m,
            line_.theta_gain * s.theta_rad + line_.theta_offset_rad, line_.cart_gain * s.cart_mps,
            line_.theta_gain * s.theta_radps};
  }
  /// gains . measured
  double volts(const FeedbackGains& gains, const PlantState<double>& s) const {
    const Measured y = (*this)(s);
    return gains[0] * y[0] + gains[1] * y[1] + gains[2] * y[2] + gains[3] * y[3];
  }
  /// The same without the offsets: for rates and the higher coefficients of a polynomial.
  double volts_of_change(const FeedbackGains& gains, const PlantState<double>& s) const {
    return gains[0] * line_.cart_gain * s.cart_m + gains[1] * line_.theta_gain * s.theta_rad +
           gains[2] * line_.cart_gain * s.cart_mps + gains[3] * line_.theta_gain * s.theta_radps;
  }

 private:
  SensorLine<double> line_;
};

/// A sampled controller with a held voltage.
template <class Engine>
class SampledLoop {
 public:
  SampledLoop(const PlantModel<double>& model, double sample_rate_hz, const EngineOptions& options = {})
      : plant_(model, options), measured_(plant_.engine().dynamics()), rate_hz_(sample_rate_hz) {}

  void start(const PlantState<double>& state, double time_s = 0.0) {
    begin_s_ = time_s;
    tick_ = 0;
    voltage_v_ = 0.0;
    plant_.start(state, time_s);
  }

  /// One period: `law(tick, Measured)` returns the voltage commanded at its beginning.
  template <class Law>
  void step(Law&& law) {
    // The positions as the sensors show them, also of a drive that gives way and an eccentric encoder.
    const Outputs<double> shown = engine().outputs();
    Measured measured = measured_(engine().state());
    measured[0] = shown.cart_m;
    measured[1] = shown.theta_rad;
    voltage_v_ = law(tick_, measured);
    plant_.command(time_of(tick_), voltage_v_);
    plant_.advance_to(time_of(++tick_));
  }

  /// Whole periods until `time_s`, or until the engine halts.
  template <class Law>
  void advance_to(double time_s, Law&& law) {
    constexpr double slack_periods = 1e-6;
    while (!engine().halted() && (time_of(tick_ + 1) - time_s) * rate_hz_ < slack_periods) step(law);
  }

  const Engine& engine() const { return plant_.engine(); }
  std::uint64_t tick() const { return tick_; }
  double voltage_v() const { return voltage_v_; }

 private:
  double time_of(std::uint64_t tick) const { return begin_s_ + static_cast<double>(tick) / rate_hz_; }

  BasicSimulator<Engine, double> plant_;
  MeasuredState measured_;
  double rate_hz_;
  double begin_s_ = 0.0;
  std::uint64_t tick_ = 0;
  double voltage_v_ = 0.0;
};

/// Dense output of one signal: a polynomial per engine step, constant before the first.
class SignalHistory {
 public:
  void start(double time_s, double value) {
    steps_.clear();
    cursor_ = 0;
    begin_s_ = time_s;
    before_ = value;
  }

  /// `at` gives the signal of a state, `change` the same without its constant part.
  template <class At, class Change>
  void add(const DenseStep& step, const At& at, const Change& change) {
    Step& kept = steps_.emplace_back();
    kept.begin_s = step.begin_s;
    kept.at_s = step.at_s;
    kept.count = step.factors;
    for (int k = 0; k < step.factors; ++k) {
      const PlantState<double>& factor = step.factor[static_cast<std::size_t>(k)];
      kept.factor[static_cast<std::size_t>(k)] = k == 0 ? at(factor) : change(factor);
    }
  }

  void forget_before(double time_s) {
    while (steps_.size() > 2 && steps_[1].begin_s < time_s) {
      steps_.pop_front();
      if (cursor_ > 0) --cursor_;
    }
  }

  double operator()(double time_s) const {
    if (steps_.empty() || time_s <= begin_s_) return before_;
    cursor_ = std::min(cursor_, steps_.size() - 1);
    while (cursor_ + 1 < steps_.size() && steps_[cursor_ + 1].begin_s <= time_s) ++cursor_;
    while (cursor_ > 0 && steps_[cursor_].begin_s > time_s) --cursor_;
    const Step& step = steps_[cursor_];
    const double t = time_s - step.at_s;
    double sum = 0.0;
    for (int k = step.count - 1; k >= 0; --k) sum = sum * t + step.factor[static_cast<std::size_t>(k)];
    return sum;
  }

 private:
  struct Step {
    double begin_s = 0.0;
    double at_s = 0.0;
    int count = 0;
    std::array<double, DenseStep::max_factors> factor{};
  };

  std::deque<Step> steps_;
  mutable std::size_t cursor_ = 0;
  double begin_s_ = 0.0;
  double before_ = 0.0;
};

/// Continuous feedback with a delay: V(t) = gains . y(t - delay), with the initial state as constant
/// history (equation (15) of the paper). The plant's own input delay is added. Steps are restarted where
/// an event, a corner of the actuator chain or the start returns through the delay. Work grows as 1 /
/// delay for delays below a millisecond; below `shortest_delay_s` the delay is neglected.
template <class Engine>
class ContinuousLoop {
 public:
  ContinuousLoop(const PlantModel<double>& model, const FeedbackGains& gains, double delay_s,
                 const EngineOptions& options = {})
      : engine_(model, options),
        measured_(engine_.dynamics()),
        gains_(gains),
        delay_s_(delay_s + engine_.dynamics().input_delay_s()) {
    if (!(delay_s_ > shortest_delay_s)) delay_s_ = 0.0;
  }

  void start(const PlantState<double>& state, double time_s = 0.0) {
    const double volts = measured_.volts(gains_, state);
    engine_.start(state, time_s, volts);
    history_.start(time_s, measured_.volts(gains_, engine_.state()));
    restarts_.clear();
    if (delay_s_ > 0.0) restart_later(time_s, 1);
  }

  /// Advances; stops early where the engine halts.
  void advance_to(double time_s) {
    if (delay_s_ > 0.0) {
      while (!engine_.halted() && engine_.time_s() < time_s) advance_delayed(time_s);
    } else if (engine_.time_s() < time_s) {
      const auto volts = [this](double, const PlantState<double>& s) { return measured_.volts(gains_, s); };
      engine_.advance(time_s - engine_.time_s(), volts, std::numeric_limits<double>::infinity(),
                      [](const DenseStep&) {});
    }
  }

  const Engine& engine() const { return engine_; }
  /// The command that acts at present, before the actuator chain.
  double voltage_v() const {
    return delay_s_ > 0.0 ? history_(engine_.time_s() - delay_s_) : measured_.volts(gains_, engine_.state());
  }
  /// Sum of the delays of the feedback and of the plant's input.
  double total_delay_s() const { return delay_s_; }

  static constexpr double shortest_delay_s = 1e-6;

 private:
  /// A time at which a derivative of the voltage is discontinuous; `order` is the lowest such derivative.
  struct Restart {
    double time_s;
    int order;
  };

  static constexpr int highest_order = 5;  // beyond the order of the Runge-Kutta engine

  void restart_later(double from_s, int order) {
    if (order > highest_order) return;
    const Restart next{from_s + delay_s_, order};
    restarts_.insert(std::upper_bound(restarts_.begin(), restarts_.end(), next,
                                      [](const Restart& a, const Restart& b) { return a.time_s < b.time_s; }),
                     next);
  }

  void advance_delayed(double time_s) {
    constexpr double same_s = 1e-12;
    double until_s = std::min(time_s, engine_.time_s() + delay_s_);
    while (!restarts_.empty() && restarts_.front().time_s <= engine_.time_s() + same_s) {
      const Restart passed = restarts_.front();
      restarts_.erase(restarts_.begin());
      restart_later(passed.time_s, passed.order + 1);
    }
    if (!restarts_.empty()) until_s = std::min(until_s, restarts_.front().time_s);
    const auto volts = [this](double t, const PlantState<double>&) { return history_(t - delay_s_); };
    engine_.advance(until_s - engine_.time_s(), volts, delay_s_, [this](const DenseStep& step) {
      history_.add(
          step, [this](const PlantState<double>& s) { return measured_.volts(gains_, s); },
          [this](const PlantState<double>& s) { return measured_.volts_of_change(gains_, s); });
      if (step.ends_at_event) restart_later(step.end_s, 1);
      if (step.ends_at_corner) restart_later(step.end_s, 2);
    });
    history_.forget_before(engine_.time_s() - delay_s_);
  }

  Engine engine_;
  MeasuredState measured_;
  FeedbackGains gains_;
  double delay_s_;
  SignalHistory history_;
  std::vector<Restart> restarts_;
};

}  // namespace upright
