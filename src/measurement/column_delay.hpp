// Columns that were written down later than they were measured or commanded.
#pragma once

#include "dataset_file.hpp"
#include "upright/measurement/measurement.hpp"

namespace upright {

/// Moves the columns with a delay_s to where they belong; the last rows of each piece, for which there is
/// nothing then, are left out. Throws ConfigError where nothing is left.
void undo_delays(Measurement& run, const Dataset& dataset);

}  // namespace upright
