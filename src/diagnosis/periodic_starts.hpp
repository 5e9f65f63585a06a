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
  /// Mass times squared speed [N m]. An encoder of eccentricity e and pitch p seems to show -2 pi e / p times
  /// as much force, with the sine of its angle: the second derivative of what it adds.
  double speed_squared_nm;
};

/// The longest pitch [m] of such an effect that these data can show.
double longest_pitch_m(const DataRange& range, const PriorPolicy& prior);

/// Values of the parameters of a periodic effect: size, pitch, phase.
std::vector<std::vector<double>> periodic_starts(std::size_t effect, const std::vector<PlaceForce>& residual,
                                                 const DataRange& range, const PriorPolicy& prior,
                                                 const SearchBudget& budget);

}  // namespace upright
