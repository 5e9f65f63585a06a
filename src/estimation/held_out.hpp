// Which of the data are held out: whole runs, or segments of a single one.
#pragma once

#include <vector>

#include "upright/estimation/segments.hpp"

namespace upright {

/// The data in two parts, by run and never by sample.
struct DataSplit {
  FitData train, held;
  std::vector<std::size_t> held_out_runs;  ///< none of a single run, a third of whose segments is held out
};

/// Which of each three in the order of their excitation is held out: the middle one, alike to the rest, or
/// another, where the fit needs what only that middle one shows. (Of two the calmer one, or the other.) `end`
/// is `middle` of several runs, and the last third of a single one.
enum class HeldOut { middle, other, end };

/// Holds out a third. The excitation of a stretch is the root mean square speed of the cart and of the tip of
/// a pendulum of length `arm_m` beside it, as differences over `speed_window_s`.
DataSplit split(const std::vector<Measurement>& runs, HeldOut which, double arm_m, double speed_window_s);

}  // namespace upright
