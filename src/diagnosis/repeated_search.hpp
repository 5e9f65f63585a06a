// When a search is worth repeating with other runs held out, and which of the two answers counts.
#pragma once

#include "estimation/held_out.hpp"
#include "selection_policy.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// Whether a search that found no missing effect may find one if other runs are held out. Two splits of the
/// same runs share out the same evidence. So an effect must have shown the least evidence on training and
/// held-out runs together, or the runs that were held out must have the largest voltage.
bool may_find_more_with_other_runs(const Diagnosis& first, const DataSplit& data,
                                   const SelectionPolicy& policy);

/// Whether the answer with other runs held out takes the place of the first one. Each search judges by its
/// own held-out runs, so all runs decide between the two: `saved` is by how much their objective is less with
/// the second answer. If both are unexplained, they must say so overwhelmingly.
bool is_better_answer(double saved, bool explains, bool first_is_unexplained, const AcceptancePolicy& policy);

}  // namespace upright
