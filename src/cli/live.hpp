// What commands with --live share: the flag, and the page of a run.
#pragma once

#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "command_line.hpp"
#include "live/live_view.hpp"
#include "runtime/realtime.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"

namespace upright::cli {

/// Adds --live[=PORT]; `port` stays empty where it is not given.
void add_live(const Command& command, std::string& port);

/// What the page of a command shows.
struct LiveSubject {
  std::string title;
  const RigFile* rig = nullptr;
  const Plant* plant = nullptr;  ///< null: not known
  double period_s = 0.0;
  RealtimeRequest realtime;
  bool fast = false;
};

/// Serves the page and says where on `out`; null where it was not asked for. Throws ConfigError where it
/// cannot be served.
std::unique_ptr<LiveView> open_live(const std::string& port, const LiveSubject& subject, std::FILE* out);

/// Runs `work`, and lets the page know when that throws.
template <class Work>
auto shown_by(LiveView* view, Work&& work) {
  try {
    return work();
  } catch (const std::exception& problem) {
    if (view != nullptr) view->end({LiveState::Kind::stopped, problem.what()});
    throw;
  }
}

}  // namespace upright::cli
