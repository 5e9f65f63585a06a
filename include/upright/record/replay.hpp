// Recomputes the voltages of a run from its counts with its controller.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "upright/base/progress.hpp"
#include "upright/control/command_source.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/record/run_reader.hpp"

namespace upright {

/// The first row that differs.
struct ReplayMismatch {
  std::uint64_t tick = 0;             ///< number of the period
  double logged_requested_v = 0.0;    ///< before the limiter
  double computed_requested_v = 0.0;  ///< the same, computed again
  double logged_v = 0.0;              ///< after the limiter
  double computed_v = 0.0;            ///< the same, computed again
};

/// What a replay found.
struct ReplayResult {
  std::uint64_t rows = 0;                        ///< number of rows compared
  std::optional<ReplayMismatch> first_mismatch;  ///< absent: every voltage agrees
  /// Tick of the first row before which the log has lost rows: from there on replay cannot be exact.
  std::optional<std::uint64_t> first_lost_tick;
};

/// All voltages, requested and applied, must be reproduced bit for bit. `parts`: those that the run's
/// controller requires (`make_model_parts`). `source`: that of the run, if it had one.
ReplayResult replay(const RunRecord& run, ModelParts parts = {}, CommandSource* source = nullptr);

/// The same with rows from a file: `run` is read without them. `progress` may be empty.
ReplayResult replay(const RunRecord& run, SampleReader& rows, ModelParts parts = {},
                    CommandSource* source = nullptr, const ProgressCallback& progress = {});

}  // namespace upright
