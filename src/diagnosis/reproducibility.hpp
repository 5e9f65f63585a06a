// Whether an effect that was found reproduces: whether two disjoint parts of the data give it consistently.
//
// Both parts are fitted with all effects. What one part says of an effect (values with their robust
// covariance) is then a belief for the other part: its own data may move the effect as far as the belief
// leaves it open. An effect is contradicted if a part is better followed without it than with what the other
// part says, by more than the scatter of the savings over segments allows. A part that does not
// excite the effect leaves everything open and contradicts nothing.
#pragma once

#include <string>
#include <vector>

#include "search.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// What the two parts say of one effect.
struct Reproduction {
  std::size_t effect = 0;
  /// What a part saves with what the other part says of the effect [evidence], and its t value: of the part
  /// where that is less. Infinite where the data cannot be divided.
  double transferred_evidence = 0.0, t_value = 0.0;
  std::vector<RunEvidence> runs;  ///< what each run saves with what its own part says [evidence]
  ShownStretch shows_most;        ///< where it saves most
  std::string where;              ///< for a reader: where it holds and where not
};

/// Of each of these effects of `h`, a fit to all data.
std::vector<Reproduction> reproduce(const Search& search, const Hypothesis& h,
                                    const std::vector<std::size_t>& effects);

bool is_contradicted(const Reproduction& reproduction, const SignificancePolicy& policy);
/// The effects that are not beyond doubt: of overwhelming evidence, and borne out by each part as surely as
/// an effect can be contradicted. Not numbers of the plant file.
std::vector<std::size_t> doubtful_effects(const std::vector<Reproduction>& reproductions,
                                          const Search& search);
/// What all runs save with what their own parts say [evidence].
double white_evidence(const Reproduction& reproduction);

}  // namespace upright
