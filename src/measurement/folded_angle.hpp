// Angles that were folded: taken modulo a range, or mirrored at its ends.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace upright {

/// The size of the jumps of values that were taken modulo something: nothing where they do not jump by nearly
/// their whole range from one row to the next. `gap_before(k)`: rows are missing before row k.
std::optional<double> find_fold(const std::vector<double>& values,
                                const std::function<bool(std::size_t)>& gap_before);

/// Adds multiples of `every`, so that no row is further than half of it from the row before.
void unfold(std::vector<double>& values, double every);

/// Mirrors values back that were mirrored at their least or largest, as the absolute value of an angle is at
/// zero: where their rate turns around within a row. Returns how often.
std::size_t unmirror(std::vector<double>& values);

}  // namespace upright
