// The JSON Schema (draft 7) of each kind of file that people write.
#pragma once

#include <span>
#include <string>

namespace upright {

/// A kind of file.
struct FileSchema {
  const char* kind;       ///< as `upright schema` names it
  std::string (*text)();  ///< the schema
};

std::span<const FileSchema> file_schemas();

}  // namespace upright
