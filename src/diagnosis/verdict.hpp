// The conclusion of a diagnosis from what was found and what is left.
#pragma once

#include <string>
#include <vector>

#include "selection_policy.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// What the verdict rests on, beside the effects and numbers of the diagnosis.
struct VerdictGrounds {
  bool structured = false;   ///< the residual is more than noise
  bool clear_gap = false;    ///< the error on held-out data is clearly larger than noise
  bool may_hide = false;     ///< the data would not have shown usual friction
  bool moves_enough = true;  ///< the runs move far beyond the steps of the sensors
};

/// Every verdict but `described`. Uses effects, numbers, gaps and effects that help here only.
Verdict verdict_of(const Diagnosis& diagnosis, const VerdictGrounds& grounds);

/// Why data in which nothing is found do not show that nothing is missing. `hidden`: the friction that may
/// hide.
std::string why_not_excited(const Diagnosis& diagnosis, const VerdictGrounds& grounds,
                            const std::vector<Detectable>& hidden);

}  // namespace upright
