// The power of a diagnosis: the smallest size of each effect that these data would have shown.
#pragma once

#include <string>
#include <vector>

#include "indistinguishable.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// Of each freed effect that the plant lacks the smallest size, of a number of the plant file how far it may
/// be off.
std::vector<Detectable> detectable_sizes(const Search& search, const Hypothesis& h,
                                         const std::vector<FreedEffect>& freed);

/// How many standard errors of its size an effect must have to be accepted with a high probability.
double standard_errors_to_be_shown(std::size_t effect, bool is_correction, const SelectionPolicy& policy);

/// Of the friction that every rig has (PowerPolicy::everywhere), what the plant lacks and these data would
/// not have shown at its usual size.
std::vector<Detectable> may_hide(const std::vector<Detectable>& detectable, const Plant& given,
                                 const PowerPolicy& policy);

/// Which effects these could hide, and below which size. Empty if there are none.
std::string sentence_on_hidden(const std::vector<Detectable>& hidden);

}  // namespace upright
