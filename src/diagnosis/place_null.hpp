// Whether a random force that belongs to the place accounts for the data as well as an effect that was found.
//
// Every track is a little rough: its force depends on the place, and is the same whenever the cart passes it.
// The likelihood counts each pass as new evidence, so an effect that resembles the track's force, such as a
// cogging force of the best pitch, is found with more evidence the longer the record is. So each effect is
// tested once more beside a random force of the place, whose values are integrated out. Its size and
// correlation length are estimated with and without the effect. They are not estimated anew for an effect
// that grows in proportion to the place, because a random force as long as the travel would do the same.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "outdone_effect.hpp"
#include "reproducibility.hpp"

namespace upright {

/// Of these effects, the one that such a force leaves the least evidence, if that is less than an effect
/// needs. An effect stays if a simulation of held-out data is far worse without it and with a constant force
/// in its place, unless its force goes up and down with the place. `known`: a fit to all data, `judged`: to
/// the training data. Corrections of the plant file's numbers are not tested.
std::optional<OutdoneEffect> outdone_by_place(Search& search, const Hypothesis& known,
                                              const Hypothesis& judged,
                                              const std::vector<Reproduction>& effects);

/// A sentence on the random force of the place that is left, if there is one. `known`: a fit to all data.
std::optional<std::string> place_force_left(const Search& search, const Hypothesis& known);

}  // namespace upright
