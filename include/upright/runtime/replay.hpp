// Feeds a run's counts through its controller again.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "upright/control/controller.hpp"
#include "upright/runtime/run_reader.hpp"

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

/// Every voltage, requested and applied, must come out bit for bit. A `compensator` is needed when the run
/// had one, and so is a `source`.
ReplayResult replay(const RunRecord& run, std::unique_ptr<DelayCompensator> compensator = nullptr,
                    CommandSource* source = nullptr);

/// The same with the rows of a file: `run` is read without them.
ReplayResult replay(const RunRecord& run, SampleReader& rows,
                    std::unique_ptr<DelayCompensator> compensator = nullptr, CommandSource* source = nullptr);

}  // namespace upright
