// The paper's Figures 2, 4 and 6 and its delay map with the quiet controller beside, inside the report.
#pragma once

#include <functional>
#include <string>

#include "paper.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// Keeps a file of the document: its name below the document's folder, and its content.
using KeepFile = std::function<void(const std::string& name, const std::string& content)>;

/// The part of the document about config/gains/quiet.yaml, in Markdown; its drawings go to `keep`.
std::string paper_with_quiet(const PaperOptions& options, const RigFile& rig, const KeepFile& keep);

}  // namespace upright
