#include "stop_watcher.hpp"

#include <cstdio>

#include "record/stop_report.hpp"
#include "signals.hpp"

namespace upright::cli {

StopWatcher stop_watcher(LiveView* view) {
  StopWatcher watcher;
  watcher.end_requests = end_requests;
  watcher.trying = [view](const StopReport& report, double left_s) {
    const std::string text = "zero volts is not confirmed yet (" + reason_of(report) + ")";
    std::fprintf(stderr, "upright: %s: upright tries again for %.0f s, or until Ctrl-C\n", text.c_str(),
                 left_s);
    if (view != nullptr) view->say({LiveState::Kind::stopped, text + ": upright tries again"});
  };
  return watcher;
}

}  // namespace upright::cli
