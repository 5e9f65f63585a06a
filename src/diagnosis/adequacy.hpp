// Whether a fitted model accounts for the data: what it leaves is noise, and what the training runs say also
// accounts for the runs that were held out.
#pragma once

#include "estimation/noise_floor.hpp"
#include "residual_tests.hpp"
#include "search.hpp"

namespace upright {

/// What a fit leaves at `fitted`, judged: its structure, and how far off a plain simulation is.
ResidualTests examine_fit(const FitData& data, const FitPoint& fitted, const SelectionPolicy& policy,
                          const SearchBudget& budget);

/// What this noise, as slow as what is left, makes of a plain simulation of the held-out data. 1 where none
/// is held out.
SimulationFloor held_out_floor(const Search& search, const Hypothesis& judged, const Noise& noise,
                               const ResidualTests& tests);

/// What is left of the training runs, which is this noise, must account for the held-out runs too, with the
/// parameters anywhere that the training runs leave open. Where it does not, `tests` becomes structured and
/// says so.
void compare_held_out(const Search& search, const Hypothesis& judged, const Noise& noise,
                      ResidualTests& tests);

}  // namespace upright
