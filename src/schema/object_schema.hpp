// The JSON Schema of an object from the ways through its list of keys: one list of properties, and rules
// "if, then, else" for what depends on words, flags and the presence of keys.
#pragma once

#include "key_branches.hpp"

namespace upright {

Json object_schema(const Branch& ways);

}  // namespace upright
