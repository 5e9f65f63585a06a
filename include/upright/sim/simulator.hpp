// A plant with its input: commands act after the plant's input delay; an engine integrates the motion.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>
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
      : engine_(model, options), delay_s_(engine_.dynamics().input_delay_s()), waiting_(max_commands) {
    if constexpr (!std::is_same_v<S, double>) held_.resize(max_parts);
  }

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
    for (;;) {
      if constexpr (!std::is_same_v<S, double>)
        while (advance_in_one_step(time_s)) {
        }
      if (count_ == 0 || !(value_of(waiting_[first_].acts_s) < time_s)) break;
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
  static constexpr std::size_t max_parts = 16;  ///< as many voltages as a step has to take

  struct Command {
    S acts_s{};
    double voltage_v = 0.0;
  };

  /// Towards `time_s` with one step for several commands, where the engine can; else false. Dual numbers
  /// only.
  bool advance_in_one_step(double time_s) {
    std::size_t parts = 0, k = 0;
    double voltage_v = acting_v_;
    S from_s = now_s_;
    for (; k < count_ && parts + 1 < max_parts && value_of(waiting(k).acts_s) < time_s; ++k) {
      if (value_of(waiting(k).acts_s) > value_of(from_s)) {
        held_[parts] = {waiting(k).acts_s - from_s, voltage_v};
        passed_[parts++] = k + 1;
        from_s = waiting(k).acts_s;
      }
      voltage_v = waiting(k).voltage_v;
    }
    if (parts == 0) return false;
    const bool all = k == count_ || !(value_of(waiting(k).acts_s) < time_s);
    if (all) {
      held_[parts] = {S(time_s) - from_s, voltage_v};
      passed_[parts++] = k;
    }
    const std::size_t taken = engine_.advance_in_one_step(held_.data(), parts);
    if (taken == 0) return false;
    const std::size_t acting = passed_[taken - 1];
    now_s_ = all && taken == parts ? S(time_s) : waiting(acting - 1).acts_s;
    if (acting > 0) acting_v_ = waiting(acting - 1).voltage_v;
    for (std::size_t i = 0; i < acting; ++i) drop_oldest();
    return true;
  }

  /// The k-th of the commands that have not acted yet.
  const Command& waiting(std::size_t k) const { return waiting_[(first_ + k) % waiting_.size()]; }

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
  // The voltages of a step, and how many commands act at the end of each.
  std::vector<HeldVoltage<S>> held_;
  std::array<std::size_t, max_parts> passed_{};
};

/// The real-time plant.
template <class S>
using Simulator = BasicSimulator<EventEngine<S>, S>;

}  // namespace upright
