// An experiment's piece as a source of commands for the one control loop: it brings the cart to where the
// piece starts and to rest, excites, brakes before the cart could leave its travel, and ends in the middle.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "piece.hpp"
#include "script_context.hpp"
#include "upright/control/command_source.hpp"

namespace upright {

/// What the script is about, for whoever watches.
enum class ScriptPhase : std::uint8_t {
  settling,  ///< to the start of the next stretch, and to rest
  waiting,   ///< for somebody's hands
  swinging_up,
  catching,  ///< by the feedback without delay, until the pendulum stands still
  acting,
  braking,
  over,
};
const char* words_for(ScriptPhase phase) noexcept;

class ExperimentScript final : public CommandSource {
 public:
  ExperimentScript(const Piece& piece, const ScriptContext& context);

  Demand next(std::uint64_t tick, const ControlState& now) noexcept override;

  ScriptPhase phase() const noexcept { return shown_.load(std::memory_order_relaxed); }
  /// How often the guard ended a stretch whose length the file gives: the travel was too small for it.
  int cut_short() const noexcept { return cut_short_; }
  /// Stretches that were done.
  std::size_t stretches_done() const noexcept { return stretch_; }
  std::size_t stretches() const noexcept { return stretches_.size(); }

 private:
  void enter(ScriptPhase phase) noexcept;
  Demand settle(const ControlState& now) noexcept;
  Demand wait(const ControlState& now) noexcept;
  Demand swing_up(const ControlState& now) noexcept;
  Demand act(const ControlState& now) noexcept;
  Demand balance(const ControlState& now) noexcept;
  Demand brake(const ControlState& now) noexcept;
  Demand catch_upright(const ControlState& now) noexcept;
  Demand engage(const ControlState& now) noexcept;
  bool can_catch(const ControlState& now) const noexcept;
  Demand finish_stretch() noexcept;
  Excitation excited(const ControlState& now) noexcept;
  void begin(const ControlState& now) noexcept;
  double servo_v(double speed_mps, const ControlState& now) noexcept;
  bool at_rest(const ControlState& now) const noexcept;
  bool leaves_travel(const ControlState& now) const noexcept;
  double limited(double voltage_v) const noexcept;
  Demand put(double voltage_v) const noexcept;

  PieceKindValue piece_;
  ScriptContext context_;
  CartServo servo_;
  std::vector<Stretch> stretches_;
  std::size_t stretch_ = 0;  ///< the one that goes on; after the last the cart is brought to the middle
  std::uint64_t tick_ = 0;
  double elapsed_s_ = 0.0;  ///< periods since the last call, as time
  ScriptPhase phase_ = ScriptPhase::settling;
  std::atomic<ScriptPhase> shown_{ScriptPhase::settling};
  double phase_s_ = 0.0;  ///< since this phase began
  double acted_s_ = 0.0;  ///< of this stretch's excitation
  double still_s_ = 0.0;
  double origin_m_ = 0.0;  ///< where the excitation began
  double upright_rad_ = 0.0;
  double caught_m_ = 0.0;  ///< where the cart was when the catch began
  double caught_s_ = 0.0;  ///< since then
  double surplus_;         ///< energy that a swing-up aims at beyond upright
  double former_rate_ = 0.0, former_lean_ = 0.0;
  int cut_short_ = 0;
  bool started_ = false, ended_ = false, arrived_ = false;
};

}  // namespace upright
