// The minimum of a function of a few numbers that has no derivatives: a global search within a box, then a
// local one.
#pragma once

#include <functional>
#include <vector>

namespace upright {

struct SearchBounds {
  double global = 1.0;  ///< the global search stays within plus and minus this
  double local = 1.0;   ///< and the local one within plus and minus this
};

/// Minimises `cost` from zero. CRS2 of NLopt (controlled random search; Kaelo and Ali 2006) takes two thirds
/// of the `evaluations`, SBPLX (Rowan 1990) the others or fewer. Returns the place of the smallest cost of
/// all, the first of equal ones. Depends on `seed` and the costs only.
std::vector<double> minimise(std::size_t numbers, const SearchBounds& bounds, int evaluations, unsigned seed,
                             const std::function<double(const std::vector<double>&)>& cost);

}  // namespace upright
