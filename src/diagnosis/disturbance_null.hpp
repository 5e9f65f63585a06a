// Whether a disturbance that no effect describes accounts for the data as well as an effect that was found.
#pragma once

#include <optional>
#include <vector>

#include "reproducibility.hpp"
#include "withdrawal.hpp"

namespace upright {

/// One of these effects that a disturbance outdoes: one that varies slowly (coloured_null.hpp), or one that
/// belongs to the place (place_null.hpp). `known`: a fit to all data, `judged`: to the training data.
std::optional<Withdrawal> outdone_by_disturbance(Search& search, const Hypothesis& known,
                                                 const Hypothesis& judged,
                                                 const std::vector<Reproduction>& effects);

}  // namespace upright
