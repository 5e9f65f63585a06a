// What these data cannot tell apart, computed from sensitivities: an effect is in doubt when another, left
// open beside it, could take its place.
#pragma once

#include <optional>
#include <vector>

#include "search.hpp"

namespace upright {

/// An effect that could stand in the place of one that was found, and the plant as it would then be.
struct Alternative {
  std::size_t instead_of = 0;
  std::size_t effect = 0;
  Plant plant;
};

/// A fit with one effect more left open, with nothing believed of it and where it does nothing.
struct FreedEffect {
  std::size_t effect = 0;
  Hypothesis with;
};

/// Each effect in turn that is not `listed` and grows from nothing: what `h` lacks, and what the plant file
/// says within a belief. Effects that these data do not show are left out.
std::vector<FreedEffect> freed_effects(const Search& search, const Hypothesis& h,
                                       const std::vector<std::size_t>& listed);

/// Whether an effect that is so many standard errors from nothing may be another, which leaves it fewer once
/// it is left open too.
bool reduces_certainty(double distance_with_other, double distance_alone, const SignificancePolicy& policy);

/// Whether an effect that was fitted in the place of another does as well: by the evidence that is lost, and
/// the t value of the loss.
bool is_indistinguishable(double evidence_lost, double t_value, const SelectionPolicy& policy);

/// The plant with an effect fitted in the place of the one that `without` lacks; none if the data distinguish
/// it from `current`, whose objective on the screening subset is given.
std::optional<Plant> fitted_alternative(Search& search, const Hypothesis& current, const Hypothesis& without,
                                        std::size_t effect, double objective_on_subset);

/// Alternatives of `listed` effects of `h` among the `freed` ones that act in proportion to their size where
/// they do nothing. What acts otherwise (saturation, lag, delay, ...) does not show here and has to be
/// fitted.
std::vector<Alternative> linear_alternatives(const Search& search, const Hypothesis& h,
                                             const std::vector<std::size_t>& listed,
                                             const std::vector<FreedEffect>& freed);

}  // namespace upright
