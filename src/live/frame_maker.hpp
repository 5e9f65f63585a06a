// What the live page is told: rows of the log turned into small JSON frames, and frames into server-sent
// events.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

#include "upright/hal/calibration.hpp"
#include "upright/record/log_record.hpp"
#include "upright/record/timing_stats.hpp"

namespace upright {

/// What stays the same while the page is shown.
struct LiveScene {
  std::string title;
  double track_limit_m = 0.0;
  double voltage_limit_v = 0.0;
  double fall_angle_rad = 0.0;
  double period_s = 1e-3;
  double pendulum_m = 0.0;  ///< from pivot to tip; 0: there is none
};

/// How the run stands, in one word for the page's colours and one line for the reader.
struct LiveState {
  enum class Kind : std::uint8_t { waiting, running, completed, stopped };
  Kind kind = Kind::waiting;
  std::string text;
};

/// Upper ends of the bins that the page draws lateness in [us]; the last bin has none.
inline constexpr std::array<double, 13> lateness_edges_us = {1,   2,   5,    10,   20,   50,   100,
                                                             200, 500, 1000, 2000, 5000, 10000};

/// One event as the page's EventSource reads it. `json` is one line.
std::string event_text(const std::string& name, const std::string& json);

/// Gathers rows and makes frames of them. A point of the curves is kept about every 5 ms; the lateness of
/// every row counts. A run that begins anew (its ticks do) begins new curves and a new count. Not safe for
/// several threads.
class FrameMaker {
 public:
  explicit FrameMaker(const LiveScene& scene);

  void add(const LogRecord& row);
  /// A pose from before the first run, while the program waits at zero volts.
  void add_pose(double time_s, const Pose& pose);
  void say(const LiveState& state) { state_ = state; }
  /// No row follows: what is shown last is no voltage, which a run that lasted its whole time has no row of.
  void rest();
  const LiveState& state() const { return state_; }
  /// Rows that did not come through to here, beyond those that were added.
  void note_unseen(std::uint64_t rows) { unseen_ += rows; }

  std::string scene_json() const;
  /// What came since the frame before.
  std::string frame_json();
  /// The same, with the points of the last seconds: what somebody who opens the page late begins with.
  std::string history_json() const;

  static constexpr double history_s = 12.0;

 private:
  struct Point {
    double time_s = 0.0, cart_m = 0.0, theta_rad = 0.0, voltage_v = 0.0;
  };
  std::string json_from(std::size_t first_point) const;
  void begin_run();
  void add_point(const Point& point);

  LiveScene scene_;
  LiveState state_;
  std::uint64_t every_ = 1;  ///< periods per point
  std::uint64_t run_ = 0, rows_ = 0, missed_ = 0, unseen_ = 0, next_point_tick_ = 0;
  LogRecord latest_;
  DurationHistogram late_;
  std::array<std::uint64_t, lateness_edges_us.size() + 1> bins_{};
  std::deque<Point> points_;
  std::size_t new_points_ = 0;  ///< of points_, at its end
};

}  // namespace upright
