// The page of an identification: parameters with intervals, friction against velocity over the data (the
// paper's Figure 3), force against velocity on a slow sine (its Figure 5).
#pragma once

#include <filesystem>
#include <vector>

#include "identification/identification.hpp"

namespace upright {

/// Friction of the cart at a constant velocity, as the plant's effects have it [N].
double steady_friction_n(const Plant& plant, double cart_mps);

/// Writes the page, and its two plots as friction.svg and slow-sine.svg beside it. Throws Error.
void write_identification_report(const Identification& identification, const std::vector<Measurement>& runs,
                                 const std::filesystem::path& file);

}  // namespace upright
