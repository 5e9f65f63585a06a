// Sines that are fitted to a force over the place, one for each frequency.
#pragma once

#include <vector>

namespace upright {

/// A force at a place, and that of an effect of size one at its crest.
struct PeriodogramSample {
  double place_m, force_n, unit_n;
};

struct FittedSine {
  double explained;  ///< of the sum of squares of the force [N^2]
  double size;       ///< [N / N], of the effect
  double frequency_per_m;
  double phase_rad;  ///< at place 0
};

/// The least-squares sine of each frequency from the lowest to the highest, beside a force that has no
/// period: the periodogram with a floating mean of Zechmeister and Kuerster, Astron. Astrophys. 496 (2009),
/// for an effect whose force also depends on something else. Frequencies that the places do not tell from a
/// constant are left out.
std::vector<FittedSine> periodogram(const std::vector<PeriodogramSample>& forces, double lowest_per_m,
                                    double highest_per_m, double spacing_per_m);

}  // namespace upright
