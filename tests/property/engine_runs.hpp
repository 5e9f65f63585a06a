// The runs on which engines are compared: each loop form over any plant, recorded every 2 ms.
#pragma once

#include <cmath>
#include <deque>
#include <numbers>
#include <vector>

#include "sim/loop/closed_loop.hpp"

namespace upright::test {

/// The paper's gain (7).
constexpr FeedbackGains paper_gains{70.7107, 304.9273, 143.3152, 61.0833};

enum class LoopForm { open, sampled, continuous };

struct RunCase {
  LoopForm form = LoopForm::open;
  double delay_s = 0.0;
  double theta0_rad = 0.05;  ///< from upright; from hanging in the open loop
  double duration_s = 10.0;
};

struct RecordedRun {
  std::vector<PlantState<double>> states;
  std::vector<Event> events;
  std::uint64_t steps = 0;
  std::uint64_t event_count = 0;
};

constexpr double record_period_s = 2e-3;

/// gains . y, whole samples late; constant before the first.
class LateFeedback {
 public:
  explicit LateFeedback(double delay_s) : late_(static_cast<std::size_t>(std::lround(delay_s * 1000.0))) {}
  double operator()(std::uint64_t, const Measured& y) {
    double volts = 0.0;
    for (std::size_t i = 0; i < 4; ++i) volts += paper_gains[i] * y[i];
    waiting_.push_back(volts);
    if (waiting_.size() > late_ + 1) waiting_.pop_front();
    return waiting_.front();
  }

 private:
  std::size_t late_;
  std::deque<double> waiting_;
};

template <class Engine>
RecordedRun record(const Plant& plant, const RunCase& run) {
  const PlantModel<double> model = make_model<double>(plant);
  EngineOptions options;
  options.track_limit_m = 5.0;
  RecordedRun result;
  const auto count = static_cast<int>(std::lround(run.duration_s / record_period_s));
  const auto keep_events = [&](const Engine& engine) {
    result.event_count = engine.event_count();
    result.steps = engine.step_count();
    const std::uint64_t kept = std::min<std::uint64_t>(result.event_count, Engine::kept_events);
    for (std::uint64_t i = 0; i < kept; ++i)
      result.events.push_back(engine.event(result.event_count - kept + i));
  };
  if (run.form == LoopForm::open) {
    BasicSimulator<Engine, double> plant_run(model, options);
    plant_run.start({0.0, std::numbers::pi + run.theta0_rad, 0.0, 0.0});
    for (int k = 0; k < count; ++k) {
      const double t = k * record_period_s;
      plant_run.command(t, 2.5 * std::sin(4.0 * t) + 1.5 * std::sin(9.3 * t));
      plant_run.advance_to((k + 1) * record_period_s);
      result.states.push_back(plant_run.engine().state());
    }
    keep_events(plant_run.engine());
    return result;
  }
  options.fall_angle_rad = 1.0;
  if (run.form == LoopForm::sampled) {
    SampledLoop<Engine> loop(model, 1000.0, options);
    LateFeedback law(run.delay_s);
    loop.start({0.0, run.theta0_rad, 0.0, 0.0});
    for (int k = 1; k <= count && !loop.engine().halted(); ++k) {
      loop.advance_to(k * record_period_s, law);
      result.states.push_back(loop.engine().state());
    }
    keep_events(loop.engine());
    return result;
  }
  ContinuousLoop<Engine> loop(model, paper_gains, run.delay_s, options);
  loop.start({0.0, run.theta0_rad, 0.0, 0.0});
  for (int k = 1; k <= count && !loop.engine().halted(); ++k) {
    loop.advance_to(k * record_period_s);
    result.states.push_back(loop.engine().state());
  }
  keep_events(loop.engine());
  return result;
}

/// Largest motion of a run about its first state, and about upright for the angle.
struct Extent {
  double cart_m = 1e-6;
  double theta_rad = 1e-6;
  explicit Extent(const RecordedRun& run) {
    for (const PlantState<double>& s : run.states) {
      cart_m = std::max(cart_m, std::abs(s.cart_m));
      theta_rad = std::max(theta_rad, std::abs(s.theta_rad - run.states.front().theta_rad));
    }
  }
  double distance(const PlantState<double>& a, const PlantState<double>& b) const {
    return std::max(std::abs(a.cart_m - b.cart_m) / cart_m, std::abs(a.theta_rad - b.theta_rad) / theta_rad);
  }
};

}  // namespace upright::test
