// How a run ended, from the text of its run.yaml.
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

  /// It ended because of late periods, a late link or late encoders. A machine that delays the run, its
  /// device or its card can cause this.
  bool of_timing() const;
  /// The interval in which a stall can have caused the end.
  Interval before() const;
};

/// None: the run has not ended, or its end was not recorded.
std::optional<RunEnd> run_end(const std::string& run_yaml);

/// Asserts how a run ended, as an assertion on timing if the end depends on timing.
void expect_end(const RunEnd& end, bool is_right, const char* file, int line);
#define EXPECT_END(end, is_right) ::upright::test::expect_end((end), (is_right), __FILE__, __LINE__)

/// Asserts, as an assertion on timing, that no run below a folder ended for a reason that depends on timing.
void expect_no_late_end(const std::filesystem::path& folder);

}  // namespace upright::test
