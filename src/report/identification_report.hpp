// The page of an identification: parameters with intervals, friction against velocity with the data (the
// paper's Figure 3), and force against velocity on a slow sine (its Figure 5).
#pragma once

#include <filesystem>
#include <vector>

#include "identification/identification.hpp"

namespace upright {

/// The friction force of the model on a cart that slides with a constant velocity at x = 0 [N].
double steady_friction_n(const Plant& plant, double cart_mps);

/// Writes the page, and its two plots as friction.svg and slow-sine.svg beside it. Throws Error.
void write_identification_report(const Identification& identification, const std::vector<Measurement>& runs,
                                 const std::filesystem::path& file);

}  // namespace upright
