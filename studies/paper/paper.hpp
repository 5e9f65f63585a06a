// The paper by Campbell, Crawford and Morris, recomputed: its figures and numbers beside ours, each from a
// run made for it, and then what its models leave out.
#pragma once

#include <filesystem>

#include "upright/base/progress.hpp"

namespace upright {

struct PaperOptions {
  std::filesystem::path config = "config";  ///< the folder with gains/, plants/ and rigs/
  unsigned threads = 0;                     ///< 0: one per processor
  /// Called before each part of the work.
  ProgressCallback progress;
};

/// Makes every run and writes `paper.md` and the plots it shows (`paper/*.svg`) into `folder`. Throws Error.
void write_paper(const std::filesystem::path& folder, const PaperOptions& options);

}  // namespace upright
