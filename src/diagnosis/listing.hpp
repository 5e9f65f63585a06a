// The held-out error as the effects are added to the model one after the other, and whether each lowers it.
#pragma once

#include <optional>
#include <vector>

#include "search.hpp"

namespace upright {

/// Errors of an open-loop simulation of held-out data [sensor noise].
struct Listing {
  struct Row {
    std::size_t effect = 0;
    double before = 0.0, after = 0.0;
  };
  double before = 0.0;  ///< of the plant file as given
  double after = 0.0;   ///< of the model with all effects
  /// Without an effect: of the numbers of the plant file within what is believed of them.
  std::optional<double> numbers_moved;
  /// The lowest error so far, and not below that of all effects: an effect that helps only together with a
  /// later one lowers nothing by itself.
  std::vector<Row> rows;
  /// An effect without which the error is lower by more than chance, or at all where all effects together
  /// raise it.
  std::optional<std::size_t> raises;
};

/// Root mean square error of a plain simulation of held-out data with these effects [noise standard
/// deviations].
double held_out_error(Search& search, const Hypothesis& judged, const std::vector<std::size_t>& effects);

/// Adds these effects in this order.
Listing list_effects(Search& search, const Hypothesis& judged, const std::vector<std::size_t>& effects);

}  // namespace upright
