// A random force or torque beside a fitted model that is no usual disturbance: it is as large as the forces
// that effects have, or it drifts. Any force that the model lacks can be taken for such a disturbance, so the
// model does not explain the data then.
//
// A force is unusual above `max_random_share` of the motor's root mean square force, a torque above
// usual_torque_nm(). The white part counts with its mean over a tenth of a second, both with the size that
// short pulses have.
#pragma once

#include "candidates.hpp"
#include "place_null.hpp"
#include "residual_tests.hpp"

namespace upright {

/// Whether tests that pass beside the `fitted` noise do so beside a force or torque that is larger than this,
/// or whose coloured part lasts for longest_correlation_s. `tests` becomes structured and says so then.
bool find_unusual_disturbance(const Noise& fitted, const DataRange& range, const PriorPolicy& prior,
                              ResidualTests& tests);

/// Adds a force of the track to an answer. A usual one is a note, since every track is a little rough. Beside
/// a larger one the data are unexplained.
void report_track_force(const TrackForce& left, const DataRange& range, const PriorPolicy& prior,
                        Diagnosis& diagnosis);

}  // namespace upright
