// Several watchers of a log in the place of one.
#pragma once

#include <vector>

#include "record/run_log.hpp"

namespace upright {

class RowWatchers final : public RowWatcher {
 public:
  /// Null: none. It must outlive this object.
  void add(RowWatcher* watcher) {
    if (watcher != nullptr) watchers_.push_back(watcher);
  }
  void see(std::span<const LogRecord> rows) noexcept override {
    for (RowWatcher* watcher : watchers_) watcher->see(rows);
  }

 private:
  std::vector<RowWatcher*> watchers_;
};

}  // namespace upright
