// The choice of held-out data: complete runs, or segments of a single run.
#pragma once

#include <array>
#include <vector>

#include "segments.hpp"

namespace upright {

/// The data in two parts. Runs are never split by samples.
struct DataSplit {
  FitData train, held;
  std::vector<std::size_t> held_out_runs;  ///< empty for a single run; a third of its segments is held out
};

/// The samples of its segments.
double sample_count(const FitData& data);

/// Which of each three runs, sorted by excitation, is held out: the middle one, which is similar to the
/// others, or another one if the fit needs what only the middle one shows. (Of two runs the less excited one,
/// or the other.) Of three or more the most excited one is never held out. `end` is `middle` for several
/// runs, and the last third of a single run.
enum class HeldOut { middle, other, end };

/// Holds out a third. The excitation is the RMS of the speeds of the cart and of the tip of a pendulum of
/// length `arm_m`, computed as differences over `speed_window_s`. Throws ConfigError if no run has a segment.
DataSplit split(const std::vector<Measurement>& runs, HeldOut which, double arm_m, double speed_window_s);

/// Whether the runs that are held out are driven by a larger voltage than all others. So they alone show what
/// a large voltage does. False for a single run.
bool largest_voltage_is_held_out(const DataSplit& data);

/// The places of the segments of two disjoint parts of the data that excite the plant alike: every second
/// run, sorted by excitation; of a single run every second segment. The second part is empty where there is
/// one segment only.
std::array<std::vector<std::size_t>, 2> halves(const FitData& data, double arm_m, double speed_window_s);

}  // namespace upright
