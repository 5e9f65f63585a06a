// How a run ended, as the text of its run.yaml says, for tests that judge it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "real_time.hpp"

namespace upright::test {

struct RunEnd {
  std::string reason;
  double stopped_s = 0.0;  ///< on the monotonic clock

  /// It was late, or its link or its encoders were: a machine that does not let it, its device or its card
  /// run in time brings that about.
  bool of_timing() const;
  /// In which a stall can have brought it about.
  Interval before() const;
};

/// None: it has not ended, or nobody has written down how.
std::optional<RunEnd> run_end(const std::string& run_yaml);

/// Asserts how a run ended: as a matter of timing where it is one.
void expect_end(const RunEnd& end, bool is_right, const char* file, int line);
#define EXPECT_END(end, is_right) ::upright::test::expect_end((end), (is_right), __FILE__, __LINE__)

/// Asserts, as a matter of timing, that no run whose directory is somewhere below a folder ended in a way
/// that is of timing.
void expect_no_late_end(const std::filesystem::path& folder);

}  // namespace upright::test
