// Columns that were recorded later than they were measured or commanded.
#pragma once

#include "dataset_file.hpp"
#include "upright/measurement/measurement.hpp"

namespace upright {

/// Shifts columns with a delay_s back in time. Drops the last rows of each piece, which then lack values.
/// Throws ConfigError if too few rows remain.
void undo_delays(Measurement& run, const Dataset& dataset);

}  // namespace upright
