// A plant with its input: commands act after the plant's input delay; an engine integrates the motion.
#pragma once

#include <cstddef>
#include <vector>

#include "upright/sim/event_engine.hpp"

namespace upright {

/// Simulates a sequence of voltage commands with any engine (EventEngine, CvodeEngine) with numbers S.
/// Allocates at construction only.
template <class Engine, class S>
class BasicSimulator {
 public:
  /// `max_commands`: the largest number of commands within the input delay (input delay times command
  /// rate, and a margin).
  explicit BasicSimulator(const PlantModel<S>& model, const EngineOptions& options = {},
                          std::size_t max_commands = 4096)
      : engine_(model, options), delay_s_(engine_.dynamics().input_delay_s()), waiting_(max_commands) {}

  /// Starts at a time, with the voltage that has acted until then.
  void start(const PlantState<S>& state, double time_s = 0.0, double acting_v = 0.0) {
    acting_v_ = acting_v;
    now_s_ = S(time_s);
    first_ = 0;
    count_ = 0;
    engine_.start(state, time_s, S(acting_v));
  }

  /// The voltage commanded from `time_s` on. Times must not decrease; commands from before the start are
  /// allowed.
  void command(double time_s, double voltage_v) {
    if (count_ == waiting_.size()) drop_oldest();
    waiting_[(first_ + count_++) % waiting_.size()] = {S(time_s) + delay_s_, voltage_v};
  }

  /// Integrates to `time_s`; each command acts at its time.
  void advance_to(double time_s) {
    while (count_ > 0 && value_of(waiting_[first_].acts_s) < time_s) {
      const Command next = waiting_[first_];
      if (value_of(next.acts_s) > value_of(now_s_)) move_to(next.acts_s);
      acting_v_ = next.voltage_v;
      drop_oldest();
    }
    if (time_s > value_of(now_s_)) move_to(S(time_s));
  }

  Engine& engine() { return engine_; }                ///< the engine, to change its state
  const Engine& engine() const { return engine_; }    ///< the engine
  double time_s() const { return value_of(now_s_); }  ///< the time now [s]
  /// The command that acts at present: after the input delay, before the rest of the actuator chain.
  double acting_v() const { return acting_v_; }

 private:
  struct Command {
    S acts_s{};
    double voltage_v = 0.0;
  };

  void drop_oldest() {
    first_ = (first_ + 1) % waiting_.size();
    --count_;
  }

  void move_to(const S& time_s) {
    engine_.advance(time_s - now_s_, S(acting_v_));
    now_s_ = time_s;
  }

  Engine engine_;
  S delay_s_;
  std::vector<Command> waiting_;
  std::size_t first_ = 0, count_ = 0;
  double acting_v_ = 0.0;
  S now_s_{};
};

/// The real-time plant.
template <class S>
using Simulator = BasicSimulator<EventEngine<S>, S>;

}  // namespace upright
