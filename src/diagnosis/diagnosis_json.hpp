// A diagnosis as the JSON document diagnosis.json.
#pragma once

#include <nlohmann/json.hpp>

#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

nlohmann::json diagnosis_json(const Diagnosis& diagnosis);

}  // namespace upright
