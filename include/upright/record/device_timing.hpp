// How a device that was the clock of a run kept time, on the computer's clock.
#pragma once

#include <cstdint>

namespace upright {

/// How the clock of a device behaved.
struct DeviceTiming {
  std::uint64_t samples = 0;  ///< that arrived, from the run's first on
  std::uint64_t lost = 0;     ///< that were due and did not arrive
  double period_s = 0.0;      ///< between two samples, on average; 0: there were no two
  /// By how much that is longer than the nominal period: positive where the device's clock is slow.
  double drift_ppm = 0.0;
};

/// Calls see(name, value) for every fact, as run.yaml and --json list them.
template <class See>
void for_each_fact(const DeviceTiming& timing, See&& see) {
  see("samples", timing.samples);
  see("lost", timing.lost);
  see("period_s", timing.period_s);
  see("drift_ppm", timing.drift_ppm);
}

}  // namespace upright
