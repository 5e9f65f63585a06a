// The page of an import: the first seconds of a foreign record, as its mapping reads it.
#pragma once

#include <filesystem>

#include "upright/measurement/measurement.hpp"

namespace upright {

/// Writes the page with the first `seconds` of the record. Throws Error.
void write_import_report(const Measurement& run, double seconds, const std::filesystem::path& file);

}  // namespace upright
