// Where fits of effects start that are periodic along the track: at the pitches that the residual has most
// of.
#pragma once

#include <vector>

#include "search_budget.hpp"
#include "selection_policy.hpp"

namespace upright {

struct DataRange;

/// A residual force at a place of the track.
struct PlaceForce {
  double cart_m;    ///< position of the cart
  double force_n;   ///< that the model lacks there
  double ripple_n;  ///< that a torque ripple of the whole motor's constant would add there
};

/// The longest pitch [m] of such an effect that these data can show.
double longest_pitch_m(const DataRange& range, const PriorPolicy& prior);

/// Values of the parameters of a periodic effect: size, pitch, phase.
std::vector<std::vector<double>> periodic_starts(std::size_t effect, const std::vector<PlaceForce>& residual,
                                                 const DataRange& range, const PriorPolicy& prior,
                                                 const SearchBudget& budget);

}  // namespace upright
