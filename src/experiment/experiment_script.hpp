// An experiment's piece as a source of commands for the one control loop: it brings the cart to where the
// piece starts and to rest, excites, brakes before the cart could leave its travel, and ends in the middle.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "experiment_file.hpp"
#include "servo_model.hpp"
#include "upright/control/command_source.hpp"
#include "upright/control/gain_file.hpp"

namespace upright {

/// Limits of a piece and what it starts from.
struct ScriptContext {
  double period_s = 1e-3;
  double travel_m = 0.3;
  double voltage_limit_v = 10.0;
  ServoModel servo;
  Gains gains;  ///< of the feedback that catches after a swing-up
};

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
  std::size_t strokes_done() const noexcept { return stroke_; }
  std::size_t strokes() const noexcept { return strokes_.size(); }

  /// Where the cart would stand if it were stopped now, braking with a part of the voltage.
  double stop_position_m(const ControlState& now) const noexcept;

 private:
  enum class Kind : std::uint8_t {
    constant,
    ramp,
    push,
    square,
    multisine,
    sine,
    observe,
    decay,
    balance,
    pulse
  };
  /// One stretch: start position, then an excitation.
  struct Stroke {
    Kind kind = Kind::observe;
    double start_m = 0.0;
    double voltage_v = 0.0;  ///< signed
    double duration_s = 0.0;
  };

  void plan_strokes();
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
  Demand finish_stroke() noexcept;
  double excitation(const Stroke& stroke, const ControlState& now) noexcept;
  double servo(double speed_mps, const ControlState& now) noexcept;
  bool at_rest(const ControlState& now) const noexcept;
  bool leaves_travel(const ControlState& now) const noexcept;
  double hanging_lean(const ControlState& now) const noexcept;
  double limited(double voltage_v) const noexcept;
  Demand put(double voltage_v) const noexcept;

  Piece piece_;
  ScriptContext context_;
  std::vector<Stroke> strokes_;
  std::array<double, 64> phases_{};
  std::size_t stroke_ = 0;
  std::uint64_t tick_ = 0;
  double elapsed_s_ = 0.0;  ///< periods since the last call, as time
  ScriptPhase phase_ = ScriptPhase::settling;
  std::atomic<ScriptPhase> shown_{ScriptPhase::settling};
  double phase_s_ = 0.0;  ///< since this phase began
  double acted_s_ = 0.0;  ///< of this stroke's excitation
  double still_s_ = 0.0;
  double origin_m_ = 0.0;  ///< where the excitation began
  double push_v_ = 0.0;    ///< integral part of the servo
  double upright_rad_ = 0.0;
  double caught_m_ = 0.0;    ///< where the cart was when the catch began
  double caught_s_ = 0.0;    ///< since then
  double farthest_m_ = 0.0;  ///< of a pulse, from where it began
  double surplus_;           ///< energy that a swing-up aims at beyond upright
  double former_rate_ = 0.0, former_lean_ = 0.0;
  int cut_short_ = 0, pulses_felt_ = 0;
  bool started_ = false, pushed_ = false, ended_ = false, arrived_ = false;
};

}  // namespace upright
