// Whether a random force that belongs to the place accounts for the data as well as an effect that was found.
//
// Every track is a little rough: its force depends on the place, and is the same whenever the cart passes it.
// The likelihood counts each pass as new evidence, so an effect that resembles the track's force, such as a
// cogging force of the best pitch, is found with more evidence the longer the record is. So each effect is
// tested once more beside a random force of the place, whose values are integrated out. Its size and
// correlation length are estimated with and without the effect. They are not estimated anew for a constant
// force and a spring, because a random force as long as the travel would do the same. Half a
// track from its centre, a real spring must leave the motor able to move the cart. A stiffer one is treated
// as any force of the place.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reproducibility.hpp"
#include "withdrawal.hpp"

namespace upright {

/// The certainty of an effect whose force is a straight line along the track, in standard errors, beside a
/// random force that keeps its size. `saved`: evidence. A few places say little of how large that force is:
/// `effective_values` is how many independent values of it the data show, and the effect is `left_out` of
/// them (1: a constant, 2: a slope). Student's t, as a normal deviate.
double certainty_beside_track(double saved, double effective_values, double left_out);

/// Of these effects, the one that such a force leaves the least evidence, if that is less than an effect
/// needs. An effect stays if a simulation of held-out data is far worse without it and with a constant force
/// in its place, unless its force goes up and down with the place. A slope stays so only if its certainty is
/// noticeable. `known`: a fit to all data, `judged`: to the training data. Corrections of the plant file's
/// numbers are not tested, nor what trend_of_place() tests.
std::optional<Withdrawal> outdone_by_place(Search& search, const Hypothesis& known, const Hypothesis& judged,
                                           const std::vector<Reproduction>& effects);

/// A constant force, or a spring too stiff to be one, whose certainty beside such a force is not noticeable,
/// whatever a simulation needs: it may be what the track's force is on average where it was measured. It is
/// not chosen among many. Overwhelming evidence stays. `known`: a fit to all data.
std::optional<Withdrawal> trend_of_place(const Search& search, const Hypothesis& known);

/// A random force of the track, which belongs to the place.
struct TrackForce {
  double deviation_n;    ///< standard deviation
  double correlation_m;  ///< correlation length
};

/// The one that is left, if there is one. `known`: a fit to all data.
std::optional<TrackForce> track_force_left(const Search& search, const Hypothesis& known);

std::string sentence_on(const TrackForce& left);

}  // namespace upright
