// The start of a simulation within a record: what was commanded before may still act, through an input delay
// and a motor lag.
#pragma once

#include <cstddef>

#include "segments.hpp"
#include "upright/model/elementary.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {

/// A motor lag has forgotten what was commanded so many time constants ago, to 6e-6 of it.
inline constexpr double lag_memory_constants = 12.0;

/// The voltage after a motor lag at the start of a segment, from the commands since sample k. The lag is
/// linear: it is followed exactly over the part of the record that it still remembers.
template <class S>
S lagged_voltage(const Dynamics<S>& dynamics, const Measurement& run, std::size_t k, std::size_t first) {
  const double start = run.time_s[first];
  S lagged = dynamics.actuate(S(k == 0 ? 0.0 : run.voltage_v[k]));
  S acting = lagged;
  S now = S(run.time_s[k]);
  const auto relax = [&](const S& until) {
    lagged =
        acting + (lagged - acting) * elementary::exp(S(-(until - now) / dynamics.motor_time_constant_s()));
    now = until;
  };
  for (std::size_t j = k; j < first; ++j) {
    const S acts = S(run.time_s[j]) + dynamics.input_delay_s();
    if (value_of(acts) >= start) break;
    relax(acts);
    acting = dynamics.actuate(S(run.voltage_v[j]));
  }
  relax(S(start));
  return lagged;
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
  std::size_t k = segment.first;
  while (k > 0 && run.time_s[k] >= start - history) --k;
  if (dynamics.has_motor_lag()) state.motor_v = lagged_voltage(dynamics, run, k, segment.first);
  double acting_v = k == 0 ? 0.0 : run.voltage_v[k];
  std::size_t next = k;
  while (next < segment.first && run.time_s[next] + delay < start) acting_v = run.voltage_v[next++];
  simulator.start(state, start, acting_v);
  for (; next < segment.first; ++next) simulator.command(run.time_s[next], run.voltage_v[next]);
}

}  // namespace upright
