// Runs that no fit saw, simulated with the model as given and with the model that a diagnosis found.
#pragma once

#include <vector>

#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// Open-loop simulation in segments of at most 2 s, each from the initial state that fits the model best.
/// Both gaps of a run have the same noise floor. Throws ConfigError for a run that is too short.
std::vector<ValidatedRun> validate(const Plant& given, const Diagnosis& diagnosis,
                                   const std::vector<Measurement>& runs);

}  // namespace upright
