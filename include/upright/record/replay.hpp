// Feeds a run's counts through its controller again.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "upright/base/progress.hpp"
#include "upright/control/controller.hpp"
#include "upright/record/run_reader.hpp"

namespace upright {

struct ReplayMismatch {
  std::uint64_t tick = 0;
  double logged_requested_v = 0.0, computed_requested_v = 0.0;
  double logged_v = 0.0, computed_v = 0.0;
};

struct ReplayResult {
  std::uint64_t rows = 0;  ///< compared
  std::optional<ReplayMismatch> first_mismatch;
  /// Tick of the first row before which the log itself lost rows: replay cannot be exact from there on.
  std::optional<std::uint64_t> first_lost_tick;
};

/// Every voltage, requested and applied, must come out bit for bit. `parts` are those that the run's
/// controller asks for (`make_model_parts`), and `source` is the run's, where it had one.
ReplayResult replay(const RunRecord& run, ModelParts parts = {}, CommandSource* source = nullptr);

/// The same with the rows of a file: `run` is read without them. `progress` may be empty.
ReplayResult replay(const RunRecord& run, SampleReader& rows, ModelParts parts = {},
                    CommandSource* source = nullptr, const ProgressCallback& progress = {});

}  // namespace upright
