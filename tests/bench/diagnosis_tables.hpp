// The figures of a diagnosis matrix as Markdown, from the records that diagnosis_matrix appends.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace upright::blind {

/// Every whole line of a file of JSON lines; a last line that was cut off is left out.
std::vector<nlohmann::json> read_records(const std::string& file);

/// The table of figures beside what must hold, what was missed, and the confusion matrix.
std::string tables_of(const std::vector<nlohmann::json>& records);

}  // namespace upright::blind
