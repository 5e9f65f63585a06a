// `--live`: one page on the loopback interface that shows a run while it goes on, and has a stop button.
//
// The way of the data: the log's writer thread puts each row into a lock-free queue and never waits; a thread
// of the view takes rows out 25 times per second and makes frames; the server's thread sends them. Neither
// has real-time priority, and both stay off the loop's processor. The loop itself does nothing for the page.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "frame_maker.hpp"
#include "record/run_log.hpp"
#include "upright/hal/calibration.hpp"

namespace upright {

struct LiveOptions {
  int port = 0;                ///< 0: any free one
  int loop_cpu = -1;           ///< processor to stay off; -1: none
  std::function<void()> stop;  ///< the button; called by another thread
};

class LiveView final : public RowWatcher {
 public:
  /// Throws ConfigError when the port cannot be had, DeviceError when threads cannot be started.
  LiveView(const LiveScene& scene, const LiveOptions& options);
  ~LiveView() override;
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;

  std::string url() const;

  void see(std::span<const LogRecord> rows) noexcept override;
  /// From any thread but the loop's and the log's.
  void say(const LiveState& state);
  /// A pose that was read outside of the loop, `time_s` after the wait for somebody began.
  void show_waiting(const std::string& text, double time_s, const Pose& pose);
  /// How it ended: sent to every open page, for which it waits a second at most. Nothing is shown afterwards.
  void end(const LiveState& state);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace upright
