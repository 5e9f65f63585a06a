// A diagnosis as the text of diagnosis.json.
#pragma once

#include <string>

#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

std::string diagnosis_json(const Diagnosis& diagnosis);

}  // namespace upright
