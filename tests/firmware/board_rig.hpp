// A board in real time: its serial line is a pseudo-terminal, its encoders and its bridge are a plant's.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "../kernel/periodic_thread.hpp"
#include "../kernel/wired_plant.hpp"
#include "board.hpp"

namespace upright::test {

/// What befalls the line as long as the pendulum is free: one in so many requests or replies; 0: none.
struct LineFaults {
  int corrupt_requests_every = 0;
  int corrupt_replies_every = 0;
  int drop_replies_every = 0;
  int late_replies_every = 0;
  double late_s = 0.0;
  int noise_every = 0;  ///< random bytes before a request and after a reply
};

/// The board's pins, as a plant sees them.
class BoardWires final : public Wires {
 public:
  explicit BoardWires(Board& board) : board_(board) {}

  double motor_v(std::int64_t) override;
  void show(const EncoderCounts& counts) override;
  void suffer(Mishap mishap) override;
  bool at_rest() const override { return at_rest_; }

  /// How often `show` is called.
  static constexpr Board::Cycles period = 2 * Board::pwm_cycles;

 private:
  void follow(Encoder encoder, std::int64_t counts);

  Board& board_;
  Mishap mishap_ = Mishap::none;
  double shown_v_ = 0.0;
  std::atomic<bool> at_rest_{true};
};

class BoardRig {
 public:
  BoardRig(const std::string& rig_text, const Pose& start, const std::filesystem::path& trace,
           const LineFaults& faults = {});
  ~BoardRig();
  BoardRig(const BoardRig&) = delete;
  BoardRig& operator=(const BoardRig&) = delete;

  /// The serial line's file, for the controller.
  const std::string& line() const { return line_; }
  void suffer(Mishap mishap) { plant_.suffer(mishap); }
  /// From now on nothing passes the line.
  void cut() { cut_ = true; }
  bool at_rest() const { return wires_.at_rest(); }
  /// The plant's record; it ends with this.
  std::vector<TraceRow> record();

 private:
  using Frame = std::vector<std::uint8_t>;
  struct Late {
    Board::Cycles leaves = 0;
    Frame bytes;
  };

  void open_line();
  void go_on(std::int64_t now_ns);
  void take_request();
  void give_reply();
  bool hits(int every);
  void break_a_bit(Frame& frame);
  Frame noise();

  Board board_{uno_pins()};
  BoardWires wires_{board_};
  WiredPlant plant_;
  LineFaults faults_;
  std::mt19937_64 random_{1};
  int near_ = -1, far_ = -1;  // ends of the pseudo-terminal
  std::string line_;
  Frame reply_;
  Board::Cycles reply_came_ = 0;
  std::vector<Late> leaving_;
  std::int64_t begun_ns_ = 0;
  Board::Cycles begun_ = 0;
  std::atomic<bool> cut_{false};
  std::optional<PeriodicThread> thread_;  // gone before what it moves
};

}  // namespace upright::test
