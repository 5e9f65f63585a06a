// Angles that were folded: taken modulo a range, or mirrored at its ends.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace upright {

/// The size of the jumps of values that were taken modulo a period. Empty if no jump from one row to the next
/// is nearly as large as the range. `gap_before(k)`: rows are missing before row k.
std::optional<double> find_fold(const std::vector<double>& values,
                                const std::function<bool(std::size_t)>& gap_before);

/// Adds multiples of `every` so that consecutive rows differ by at most half of it.
void unfold(std::vector<double>& values, double every);

/// Undoes the mirroring of values at their minimum or maximum, like the absolute value of an angle at zero:
/// wherever the rate reverses within a row. Returns how often.
std::size_t unmirror(std::vector<double>& values);

}  // namespace upright
