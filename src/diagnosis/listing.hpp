// The held-out error as the effects are added to the model one after the other, and whether each lowers it.
#pragma once

#include <optional>
#include <vector>

#include "search.hpp"

namespace upright {

/// What a model lists.
struct ListedModel {
  std::vector<std::size_t> effects;      ///< in the order in which they are added
  std::vector<std::size_t> corrections;  ///< those of `effects` that are numbers of the plant file
};

/// Errors of an open-loop simulation of held-out data [sensor noise].
struct Listing {
  struct Row {
    std::size_t effect = 0;
    double before = 0.0, after = 0.0;
  };
  double before = 0.0;  ///< of the plant file as given, and not below `after`
  double after = 0.0;   ///< of the model with all effects
  /// Without an effect: of the numbers of the plant file within what is believed of them.
  std::optional<double> numbers_moved;
  /// The lowest error so far, and not below that of all effects: an effect that helps only together with a
  /// later one lowers nothing by itself.
  std::vector<Row> rows;
  /// A number of the plant file with which the segments are simulated better than with the fitted one.
  std::optional<std::size_t> number_raises;
  /// Else an effect without which they are simulated better. Both by more than chance.
  std::optional<std::size_t> raises;
};

/// Root mean square error of a plain simulation of held-out data with these effects [noise standard
/// deviations].
double held_out_error(Search& search, const Hypothesis& judged, const std::vector<std::size_t>& effects);

/// Adds the effects of a model.
Listing list_effects(Search& search, const Hypothesis& judged, const ListedModel& model);

/// States the gaps of a diagnosis in another unit: each is multiplied by the factor.
void scale_gaps(Diagnosis& diagnosis, double factor);

}  // namespace upright
