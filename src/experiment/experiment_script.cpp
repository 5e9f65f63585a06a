#include "experiment_script.hpp"

#include <algorithm>
#include <cmath>

#include "base/angle_units.hpp"
#include "model/rigid_body.hpp"
#include "upright/model/elementary.hpp"

namespace upright {

namespace {

// The way between stretches.
constexpr double fastest_approach_mps = 0.3;
constexpr double swing_damping = 0.25;  // of the hanging pendulum, by moving the cart

// Rest.
// Driven to within the first; bristles may then push the cart back, but not beyond the second.
constexpr double place_tolerance_m = 0.004, springs_back_m = 0.012;
constexpr double rest_mps = 0.01;
constexpr double rest_s = 0.3;
constexpr double longest_settling_s = 90.0;

// Held upright: "angle and rate are small for half a second".
constexpr double held_lean_rad = 0.15;
constexpr double held_radps = 0.3;
constexpr double held_s = 0.5;

// Swing-up and catch.
constexpr double pump_gain = 1.5;
// Energy aimed at in excess of upright, in units of that between level and upright. A model that is a little
// off would stop short, or pass over the top, for ever: each time moves the aim.
constexpr double first_surplus = 0.04, surplus_step = 0.03, max_surplus = 0.4;
constexpr double max_pump_mps2 = 5.0;
constexpr double centring_per_s2 = 6.0, centring_per_s = 1.5;
constexpr double catch_lean_rad = 0.35;
// The feedback may ask for this many times the voltage there is: it is over in a tenth of a second.
constexpr double catch_saturation = 5.0;
constexpr double lost_lean_rad = 0.5;
constexpr double catch_glide_s = 0.1;
constexpr double caught_lean_rad = 0.03, caught_within_m = 0.05;
constexpr double recentring_s = 1.0;

}  // namespace

const char* words_for(ScriptPhase phase) noexcept {
  switch (phase) {
    case ScriptPhase::settling:
      return "moving to the start";
    case ScriptPhase::waiting:
      return "waiting for you";
    case ScriptPhase::swinging_up:
      return "swinging up";
    case ScriptPhase::catching:
      return "catching";
    case ScriptPhase::acting:
      return "measuring";
    case ScriptPhase::braking:
      return "braking";
    case ScriptPhase::over:
      return "over";
  }
  return "";
}

ExperimentScript::ExperimentScript(const Piece& piece, const ScriptContext& context)
    : piece_(piece.kind),
      context_(context),
      servo_(context.servo),
      stretches_(piece_->stretches(context)),
      surplus_(first_surplus) {}

double ExperimentScript::limited(double voltage_v) const noexcept {
  return std::clamp(voltage_v, -context_.voltage_limit_v, context_.voltage_limit_v);
}

Demand ExperimentScript::put(double voltage_v) const noexcept {
  Demand demand;
  demand.feedback = false;
  demand.voltage_v = limited(voltage_v);
  return demand;
}

void ExperimentScript::enter(ScriptPhase phase) noexcept {
  phase_ = phase;
  shown_.store(phase, std::memory_order_relaxed);
  phase_s_ = 0.0;
  still_s_ = 0.0;
  servo_.reset();
  arrived_ = false;
}

bool ExperimentScript::leaves_travel(const ControlState& now) const noexcept {
  const double stop = stop_position_m(context_, now);
  return std::abs(stop) > context_.travel_m && stop * now.cart_velocity_mps > 0.0;
}

double ExperimentScript::servo_v(double speed_mps, const ControlState& now) noexcept {
  return servo_.voltage_v(speed_mps, now, elapsed_s_);
}

bool ExperimentScript::at_rest(const ControlState& now) const noexcept {
  if (std::abs(now.cart_velocity_mps) > rest_mps) return false;
  if (context_.servo.pendulum_m == 0.0) return true;
  return hangs_still(context_, now);
}

Demand ExperimentScript::settle(const ControlState& now) noexcept {
  const bool last = stretch_ == stretches_.size();
  const double target = last ? 0.0 : stretches_[stretch_].start_m;
  const double off_m = std::abs(now.cart_m - target);
  arrived_ = off_m < place_tolerance_m || (arrived_ && off_m < springs_back_m);
  if (arrived_ && at_rest(now)) {
    servo_.reset();
    still_s_ += elapsed_s_;
    if (still_s_ > rest_s) {
      if (last) return finish_stretch();
      if (piece_->balances())
        enter(piece_->swings_up() ? ScriptPhase::swinging_up : ScriptPhase::waiting);
      else
        enter(ScriptPhase::acting);
      origin_m_ = now.cart_m;
    }
    return put(0.0);
  }
  still_s_ = 0.0;
  if (phase_s_ > longest_settling_s) {
    Demand demand = put(0.0);
    demand.timed_out = true;
    return demand;
  }
  const ServoModel& m = context_.servo;
  double speed = arrived_ ? 0.0 : approach_per_s * (target - now.cart_m);
  if (m.pendulum_m > 0.0)
    speed -= 2.0 * swing_damping * std::sqrt(m.gravity_mps2 * m.pendulum_m) *
             elementary::sin(hanging_lean(context_, now));
  speed = std::clamp(speed, -fastest_approach_mps, fastest_approach_mps);
  if (leaves_travel(now)) speed = 0.0;
  const double voltage = servo_v(speed, now);
  // Beyond its travel, where a fall may have left it, nothing pushes the cart farther out.
  const bool pushes_out = std::abs(now.cart_m) > context_.travel_m && voltage * now.cart_m > 0.0;
  Demand demand = put(pushes_out ? 0.0 : voltage);
  demand.homing = true;
  return demand;
}

Demand ExperimentScript::wait(const ControlState& now) noexcept {
  bool ready = std::abs(now.cart_velocity_mps) < rest_mps;
  if (piece_->balances())
    ready = ready && std::abs(wrapped(now.theta_rad)) < held_lean_rad &&
            std::abs(now.pendulum_rate_radps) < held_radps && std::abs(now.cart_m) < context_.travel_m;
  else
    ready = ready && piece_->is_ready(now, context_);
  still_s_ = ready ? still_s_ + elapsed_s_ : 0.0;
  Demand demand = put(0.0);
  if (still_s_ > held_s) {
    if (piece_->balances()) return engage(now);
    enter(ScriptPhase::acting);
    origin_m_ = now.cart_m;
  } else if (phase_s_ > piece_->patience_s()) {
    demand.timed_out = true;
  }
  return demand;
}

/// The feedback takes over from here.
Demand ExperimentScript::engage(const ControlState& now) noexcept {
  enter(ScriptPhase::acting);
  acted_s_ = 0.0;
  upright_rad_ = full_turn_rad * std::round(now.theta_rad / full_turn_rad);
  return balance(now);
}

/// Near upright, and the feedback would not ask for much more than the amplifier has.
bool ExperimentScript::can_catch(const ControlState& now) const noexcept {
  const double lean = wrapped(now.theta_rad);
  const Gains& k = context_.gains;
  const double asked = k.pendulum_angle_v_per_rad * lean +
                       k.pendulum_rate_v_per_radps * now.pendulum_rate_radps +
                       k.cart_velocity_v_per_mps * now.cart_velocity_mps;
  return std::abs(lean) < catch_lean_rad && std::abs(asked) < catch_saturation * context_.voltage_limit_v;
}

/// Pumps the pendulum's energy up to what it has upright (0), the cart kept about the middle: the cart
/// accelerates against the swing.
Demand ExperimentScript::swing_up(const ControlState& now) noexcept {
  if (can_catch(now)) {
    const double waited = phase_s_;
    enter(ScriptPhase::catching);
    phase_s_ = waited;
    caught_s_ = 0.0;
    caught_m_ = now.cart_m + catch_glide_s * now.cart_velocity_mps;
    upright_rad_ = full_turn_rad * std::round(now.theta_rad / full_turn_rad);
    former_rate_ = former_lean_ = 0.0;
    return catch_upright(now);
  }
  const ServoModel& m = context_.servo;
  if (phase_s_ > piece_->patience_s()) {
    Demand demand = put(0.0);
    demand.timed_out = true;
    return demand;
  }
  const double lean = wrapped(now.theta_rad);
  const bool high = std::abs(lean) < 1.2;
  if (high && now.pendulum_rate_radps * former_rate_ < 0.0) surplus_ += surplus_step;
  if (high && lean * former_lean_ < 0.0) surplus_ -= surplus_step;
  surplus_ = std::clamp(surplus_, -max_surplus, max_surplus);
  former_rate_ = now.pendulum_rate_radps;
  former_lean_ = lean;
  if (leaves_travel(now)) return put(servo_v(0.0, now));
  const auto [s, c] = elementary::sine_and_cosine(now.theta_rad);
  const double w = now.pendulum_rate_radps;
  const double energy = 0.5 * w * w + m.gravity_mps2 / m.pendulum_m * (c - 1.0 - surplus_);
  const double pumping = w * c;
  double pump = pump_gain * energy * pumping / (std::abs(pumping) + 0.3);
  pump = std::clamp(pump, -max_pump_mps2, max_pump_mps2);
  // A hanging pendulum at rest gives no direction: any will do.
  if (std::abs(w) < 0.05 && c < -0.99) pump = max_pump_mps2;
  const double wanted = pump - centring_per_s2 * now.cart_m - centring_per_s * now.cart_velocity_mps;
  const double turning = pendulum_radps2(s, c, wanted, m.gravity_mps2, m.pendulum_m);
  const double force =
      m.mass_kg * (wanted + m.reaction_m * pendulum_reaction(s, c, w, turning)) +
      m.damping_n_per_mps * now.cart_velocity_mps +
      m.sliding_n * sign(std::abs(now.cart_velocity_mps) > standing_mps ? now.cart_velocity_mps : wanted);
  return put(force / m.force_per_volt_n);
}

/// The gains without delay, the cart led back to the middle, until angle and rate have been small for half a
/// second. A catch that fails is another swing.
Demand ExperimentScript::catch_upright(const ControlState& now) noexcept {
  const double lean = now.theta_rad - upright_rad_;
  if (std::abs(lean) > lost_lean_rad || leaves_travel(now)) {
    const double waited = phase_s_;
    enter(ScriptPhase::swinging_up);
    phase_s_ = waited;
    return put(servo_v(0.0, now));
  }
  const bool still = std::abs(lean) < caught_lean_rad && std::abs(now.pendulum_rate_radps) < held_radps &&
                     std::abs(now.cart_m) < caught_within_m;
  still_s_ = still ? still_s_ + elapsed_s_ : 0.0;
  if (still_s_ > held_s) return engage(now);
  const Gains& k = context_.gains;
  const double reference = caught_m_ * elementary::exp(-caught_s_ / recentring_s);
  caught_s_ += elapsed_s_;
  return put(k.cart_position_v_per_m * (now.cart_m - reference) + k.pendulum_angle_v_per_rad * lean +
             k.cart_velocity_v_per_mps * now.cart_velocity_mps +
             k.pendulum_rate_v_per_radps * now.pendulum_rate_radps);
}

Demand ExperimentScript::balance(const ControlState&) noexcept {
  Demand demand;
  demand.reference_rad = upright_rad_;
  demand.reference_m = piece_->reference_m(acted_s_);
  if (acted_s_ >= stretches_[stretch_].duration_s) {
    enter(ScriptPhase::over);
    demand = put(0.0);
    demand.over = true;
  }
  acted_s_ += elapsed_s_;
  return demand;
}

Excitation ExperimentScript::excited(const ControlState& now) noexcept {
  return {
      stretches_[stretch_], context_, now, acted_s_, elapsed_s_, std::abs(now.cart_m - origin_m_), servo_};
}

Demand ExperimentScript::act(const ControlState& now) noexcept {
  if (piece_->balances()) return balance(now);
  const Excitation at = excited(now);
  const StretchStatus status = piece_->status(at);
  if (status == StretchStatus::lost) {
    Demand demand = put(0.0);
    demand.timed_out = true;
    return demand;
  }
  bool done = status == StretchStatus::done;
  if (piece_->is_driven() && leaves_travel(now)) {
    if (piece_->resumes())
      ++cut_short_;
    else
      done = true;
    if (!done) {
      enter(ScriptPhase::braking);
      return brake(now);
    }
  }
  if (done) {
    ended_ = true;
    if (!piece_->is_driven()) return finish_stretch();
    enter(ScriptPhase::braking);
    return brake(now);
  }
  const Demand demand = put(piece_->voltage_v(at));
  acted_s_ += elapsed_s_;
  return demand;
}

Demand ExperimentScript::brake(const ControlState& now) noexcept {
  if (std::abs(now.cart_velocity_mps) < standing_mps) {
    if (ended_) return finish_stretch();
    enter(ScriptPhase::settling);
    return put(0.0);
  }
  return put(servo_v(0.0, now));
}

/// On to the next stretch, or to the end.
Demand ExperimentScript::finish_stretch() noexcept {
  Demand demand = put(0.0);
  const bool was_centring = stretch_ == stretches_.size();
  if (!was_centring && piece_->has_enough(++stretch_)) stretch_ = stretches_.size();
  acted_s_ = 0.0;
  ended_ = false;
  if (was_centring || (stretch_ == stretches_.size() && !piece_->is_driven())) {
    enter(ScriptPhase::over);
    demand.over = true;
    return demand;
  }
  enter(piece_->opening() == Opening::waiting ? ScriptPhase::waiting : ScriptPhase::settling);
  return demand;
}

/// The first phase.
void ExperimentScript::begin(const ControlState& now) noexcept {
  if (piece_->opening() == Opening::at_once) enter(ScriptPhase::acting);
  if (piece_->opening() == Opening::waiting) enter(ScriptPhase::waiting);
  if (!piece_->balances()) return;
  // Upright already, within the travel: nothing to settle.
  if (std::abs(now.cart_m) > context_.travel_m)
    enter(ScriptPhase::settling);
  else if (piece_->swings_up())
    enter(can_catch(now) ? ScriptPhase::swinging_up : ScriptPhase::settling);
  else
    enter(std::abs(wrapped(now.theta_rad)) < 2.0 * held_lean_rad ? ScriptPhase::waiting
                                                                 : ScriptPhase::settling);
}

Demand ExperimentScript::next(std::uint64_t tick, const ControlState& now) noexcept {
  elapsed_s_ = started_ ? static_cast<double>(tick - tick_) * context_.period_s : context_.period_s;
  tick_ = tick;
  if (!started_) {
    started_ = true;
    begin(now);
  }
  phase_s_ += elapsed_s_;
  switch (phase_) {
    case ScriptPhase::settling:
      return settle(now);
    case ScriptPhase::waiting:
      return wait(now);
    case ScriptPhase::swinging_up:
      return swing_up(now);
    case ScriptPhase::catching:
      return catch_upright(now);
    case ScriptPhase::acting:
      return act(now);
    case ScriptPhase::braking:
      return brake(now);
    case ScriptPhase::over:
      break;
  }
  Demand demand = put(0.0);
  demand.over = true;
  return demand;
}

}  // namespace upright
