// The start of a simulation within a record: what was commanded before may still act, through an input delay
// and a motor lag.
#pragma once

#include <cstddef>

#include "segments.hpp"
#include "upright/model/elementary.hpp"
#include "upright/sim/simulator.hpp"
#include "voltage_commands.hpp"

namespace upright {

/// A motor lag has forgotten what was commanded so many time constants ago, to 6e-6 of it.
inline constexpr double lag_memory_constants = 12.0;

/// The voltage after a motor lag at time `start`, from the commands `first` to before `end`. The lag is
/// linear: it is followed exactly over the part of the record that it still remembers.
template <class S>
S lagged_voltage(const Dynamics<S>& dynamics, const VoltageCommands& commands, std::size_t first,
                 std::size_t end, double start) {
  S lagged = dynamics.actuate(S(first == 0 ? 0.0 : commands[first].voltage_v));
  S acting = lagged;
  S now = S(commands[first].time_s);
  const auto relax = [&](const S& until) {
    lagged =
        acting + (lagged - acting) * elementary::exp(S(-(until - now) / dynamics.motor_time_constant_s()));
    now = until;
  };
  for (std::size_t j = first; j < end; ++j) {
    const S acts = S(commands[j].time_s) + dynamics.input_delay_s();
    if (value_of(acts) >= start) break;
    relax(acts);
    acting = dynamics.actuate(S(commands[j].voltage_v));
  }
  relax(S(start));
  return lagged;
}

/// The plant of a run that began with its first sample.
template <class S>
PlantModel<S> make_model_of_run(const Plant& plant, const Measurement& run) {
  PlantModel<S> model = make_model<S>(plant, run.cart_locked);
  model.start_s = run.time_s.front();
  return model;
}

/// Brings a simulator to the start of a segment with the commands that can still be acting there. Before the
/// record the motor had no voltage.
template <class S>
void start_segment(Simulator<S>& simulator, const Measurement& run, const Segment& segment,
                   PlantState<S> state) {
  const Dynamics<S>& dynamics = simulator.engine().dynamics();
  const double delay = value_of(dynamics.input_delay_s());
  const double start = run.time_s[segment.first];
  double history = delay;
  if (dynamics.has_motor_lag()) history += lag_memory_constants * value_of(dynamics.motor_time_constant_s());
  const VoltageCommands commands(run);
  const std::size_t end = commands.first_of(segment.first);
  std::size_t next = end;
  while (next > 0 && commands[next].time_s >= start - history) --next;
  if (dynamics.has_motor_lag()) state.motor_v = lagged_voltage(dynamics, commands, next, end, start);
  double acting_v = next == 0 ? 0.0 : commands[next].voltage_v;
  while (next < end && commands[next].time_s + delay < start) acting_v = commands[next++].voltage_v;
  simulator.start(state, start, acting_v);
  for (; next < end; ++next) simulator.command(commands[next].time_s, commands[next].voltage_v);
}

/// Hands a simulator the commands of a sample, up to the next sample.
template <class S>
void command_from(std::size_t sample, const Measurement& run, Simulator<S>& simulator) {
  const VoltageCommands commands(run);
  for (std::size_t i = commands.first_of(sample), end = commands.first_of(sample + 1); i < end; ++i)
    simulator.command(commands[i].time_s, commands[i].voltage_v);
}

/// How many commands a simulator of a segment must be able to hold.
inline std::size_t max_commands(const Measurement& run, const Segment& segment) {
  constexpr std::size_t margin = 64;
  const VoltageCommands commands(run);
  return margin + commands.first_of(segment.last) - commands.first_of(segment.first);
}

}  // namespace upright
