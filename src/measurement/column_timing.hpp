// Columns of a record that are later than others by a constant time.
#pragma once

#include <optional>

#include "data_hypotheses.hpp"

namespace upright {

/// The reading with what is certainly late taken as late, and said; nothing where nothing is. That the motion
/// comes after the voltage is a rig's own delay and no mistake.
std::optional<DataReading> with_lateness(const ReadingJudge& judge, DataReading reading);

}  // namespace upright
