// A diagnosis as the JSON document that the interface fixes.
#pragma once

#include <nlohmann/json.hpp>

#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

nlohmann::json diagnosis_json(const Diagnosis& diagnosis);

}  // namespace upright
