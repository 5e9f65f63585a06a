// Who waits for the end of a run: while zero volts is not confirmed the terminal and the page say so.
#pragma once

#include "live/live_view.hpp"
#include "runtime/zero_volts.hpp"

namespace upright::cli {

/// `view` may be null; it must outlive the watcher. A further Ctrl-C ends the waiting. Only after
/// `catch_signals`.
StopWatcher stop_watcher(LiveView* view);

}  // namespace upright::cli
