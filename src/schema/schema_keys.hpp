// The visitor of a list of keys that makes its JSON Schema.
#pragma once

#include <set>

#include "experiment/piece_keys.hpp"
#include "key_branches.hpp"

namespace upright {

/// The schema of an object with these keys.
Json schema_of(const PieceKeys::VisitPiece& visit);

}  // namespace upright
