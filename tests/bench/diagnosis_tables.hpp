// The figures of a diagnosis matrix as Markdown, from the records that diagnosis_matrix appends.
#pragma once

#include <string>

#include "diagnosis_records.hpp"

namespace upright::blind {

/// One-sided 95 percent bounds of a share (Clopper and Pearson).
double share_upper_bound(double hits, double count);
double share_lower_bound(double hits, double count);

/// The table of figures beside what must hold, what was missed, and the confusion matrix.
std::string tables_of(const Records& records);

}  // namespace upright::blind
