// A run on a real rig whose controller computes a value that is not a number, in this process.
#pragma once

#include <filesystem>
#include <optional>

namespace upright::test {

struct BrokenRun {
  std::filesystem::path directory;
  double began_s = 0.0;  ///< when the value was computed, on the monotonic clock
};

/// None: the rig does not open, or the run ends before that value.
std::optional<BrokenRun> broken_run(const std::filesystem::path& rig_file,
                                    const std::filesystem::path& gain_file,
                                    const std::filesystem::path& runs);

}  // namespace upright::test
