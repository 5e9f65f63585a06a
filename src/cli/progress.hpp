// What a command shows on stderr while it works: how far it is, the time it has taken and the time it will
// still take. On a terminal one line that is drawn anew, elsewhere one line every ten seconds. Stdout is left
// to the results.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <limits>
#include <mutex>
#include <string>
#include <thread>

#include "upright/base/progress.hpp"

namespace upright::cli {

/// Whole seconds up to two minutes, then minutes, then hours.
std::string duration_text(double seconds);

/// Shows nothing for work that ends within a second. A thread of its own draws, so that the elapsed time goes
/// on where the work itself reports nothing. All members may be called by any thread.
class Progress {
 public:
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

  /// `step`: what is being done, in a few words ("sweep", "reading the data"). `takes_s`: how long it will
  /// take, where that is known beforehand; its share is then that of the time.
  explicit Progress(std::string step, double takes_s = unknown);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// The next step: the elapsed time goes on, the share and the estimate begin anew.
  void begin(std::string step, double takes_s = unknown);
  /// `share` of the step that is done, 0 to 1, or `unknown`; `detail`: a few words about it.
  void report(double share, const std::string& detail = {});
  /// The same for a search. If its share falls when it was nearly done, the search has begun again. Nobody
  /// knows how long that takes, so the rest of the step shows neither a share nor an estimate.
  void report_search(double share, const std::string& detail);
  /// The same by count: "12 of 40 runs".
  void report(std::size_t done, std::size_t known, const std::string& things);
  /// Takes the line off the terminal for good: before the results are printed.
  void end();
  /// Calls `speak`, which prints something else, with the line off the terminal.
  void aside(const std::function<void()>& speak);
  /// `report` for who works. This object must outlive it.
  ProgressCallback callback();

 private:
  using Time = std::chrono::steady_clock::time_point;

  void draw_until_closed();
  void update_estimate(Time now);
  std::string line(Time now, std::size_t columns) const;
  std::string time_left(Time now) const;
  void clear_line();

  const bool on_terminal_;
  const Time started_;
  Time step_began_;
  double expected_s_;  ///< of this step
  std::mutex mutex_;
  std::condition_variable changed_;
  bool closing_ = false;
  std::string step_, detail_;
  bool several_steps_ = false;
  bool begun_again_ = false;
  double share_ = unknown;
  double first_share_ = unknown;  ///< of this step: what was done before took no time now
  Time first_report_{};
  std::size_t drawn_columns_ = 0;
  std::thread drawer_;
};

}  // namespace upright::cli
