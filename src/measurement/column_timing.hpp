// Columns of a record that are later than others by a constant time.
#pragma once

#include <optional>

#include "data_hypotheses.hpp"

namespace upright {

/// The reading with late columns corrected and named; empty if none is certainly late. A motion that comes
/// after the voltage is a delay of the rig and not a mistake.
std::optional<DataReading> with_lateness(const ReadingJudge& judge, DataReading reading);

}  // namespace upright
