// A board, a plant behind it, and the files of an `upright run` that drives it.
#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "../fault/process_case.hpp"
#include "../integration/virtual_rig_process.hpp"
#include "board_rig.hpp"

namespace upright::test {

/// Whose clock the loop follows.
enum class LoopClock { computer, board };

class BoardSetting : public RunFolder {
 public:
  explicit BoardSetting(const ProcessCase& c = {}, const LineFaults& faults = {},
                        LoopClock clock = LoopClock::computer)
      : board_(rig_text(clock), Pose{0.0, theta0_rad}, folder() / "trace.csv", faults) {
    std::ofstream(rig_file()) << as_read(c, replaced(rig_text(clock), "/dev/ttyACM0", board_.line()));
    std::ofstream(gain_file()) << text_of(UPRIGHT_SOURCE_DIR "/config/gains/exponential-200hz.yaml");
  }
  BoardRig& board() { return board_; }

 private:
  static constexpr double theta0_rad = 0.03;

  /// The shipped file, except that the board was switched on in the middle of the track with its pendulum
  /// upright, and that the machine may be busy: what is tested here is what is done, not how fast.
  static std::string rig_text(LoopClock clock) {
    const std::string text =
        replaced(replaced(text_of(UPRIGHT_SOURCE_DIR "/config/rigs/board.yaml"), "{at: start, pose: hanging}",
                          "{at: counts, cart_counts: 0, pendulum_counts: 0, pose: upright}"),
                 "response_timeout_s: 0.002", "response_timeout_s: 0.003");
    return clock == LoopClock::computer
               ? text
               : text +
                     "  device_clock: {sample_address: 9, period_address: 19, seconds_per_count: 1.0e-6}\n";
  }

  BoardRig board_;
};

}  // namespace upright::test
