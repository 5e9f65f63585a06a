// Cases as on rigs of a laboratory, for Condition::laboratory:
// - rigs: carts of 0.3 to 100 kg; time constant, gear, friction, pendulum and travel are drawn for each;
// - records: 1 to 8 runs of 2 to 60 s at 100 Hz to 2 kHz, within the samples of the request;
// - sensors: half of them quantised; the others not, with white noise, some with a little coloured noise;
// - what is unmodelled: Gauss-Markov forces and torques that remember 10 ms to 1 s, in half of the rigs more
//   of the force at speed; in a third a track that is a little rough; jitter;
// - a plant file whose numbers are up to 5 percent off.
#pragma once

#include "blind_case.hpp"

namespace upright::blind {

Case make_laboratory_case(const Request& request);

/// A run of the rig that the diagnosis does not get: the plan of the first run with other draws.
Measurement measure_fresh(const Case& blind);

}  // namespace upright::blind
