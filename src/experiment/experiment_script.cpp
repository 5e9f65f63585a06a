#include "experiment_script.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "upright/model/elementary.hpp"

namespace upright {

namespace {

constexpr double pi = std::numbers::pi;

// The velocity servo that moves the cart between stretches.
constexpr double servo_bandwidth_radps = 15.0;
constexpr double approach_per_s = 3.0;
constexpr double fastest_approach_mps = 0.3;
constexpr double standing_mps = 0.003;
constexpr double push_gain = 20.0;  // V/s per m/s that is missing
constexpr double most_push_v = 3.0;
constexpr double swing_damping = 0.25;  // of the hanging pendulum, by moving the cart

// Rest.
// Driven to within the first; bristles may then push the cart back, but not beyond the second.
constexpr double place_tolerance_m = 0.004, springs_back_m = 0.012;
constexpr double rest_mps = 0.01;
// A cart that sticks cannot take out the last few degrees of a swing.
constexpr double rest_lean_rad = 0.045;
constexpr double rest_radps = 0.25;
constexpr double rest_s = 0.3;
constexpr double longest_settling_s = 90.0;

// Held upright: "angle and rate are small for half a second".
constexpr double held_lean_rad = 0.15;
constexpr double held_radps = 0.3;
constexpr double held_s = 0.5;

// The guard that keeps the cart on its travel brakes with this much.
constexpr double braking_v = 6.0;
constexpr double braking_share = 0.6;
constexpr double reaction_s = 0.01;

// Swing-up and catch.
constexpr double pump_gain = 1.5;
// Energy aimed at in excess of upright, in units of that between level and upright. A model that is a little
// off would stop short, or pass over the top, for ever: each time moves the aim.
constexpr double first_surplus = 0.04, surplus_step = 0.03, most_surplus = 0.4;
constexpr double most_pump_mps2 = 5.0;
constexpr double centring_per_s2 = 6.0, centring_per_s = 1.5;
constexpr double catch_lean_rad = 0.35;
// The feedback may ask for this many times the voltage there is: it is over in a tenth of a second.
constexpr double catch_saturation = 5.0;
constexpr double lost_lean_rad = 0.5;
constexpr double catch_glide_s = 0.1;
constexpr double caught_lean_rad = 0.03, caught_within_m = 0.05;
constexpr double recentring_s = 1.0;

constexpr double breakaway_seen_mps = 0.03;
constexpr double breakaway_seen_m = 0.03;
constexpr double start_margin_m = 0.015;
constexpr double longest_stretch_s = 10.0;
constexpr double kick_s = 0.1;
constexpr double coast_s = 2.0;
constexpr double pulse_s = 0.12, after_pulse_s = 1.2, pulse_step_v = 0.5, pulse_felt_m = 0.005;

double sign(double value) {
  return value < 0.0 ? -1.0 : 1.0;
}

double wrapped(double angle_rad) {
  return angle_rad - 2.0 * pi * std::round(angle_rad / (2.0 * pi));
}

}  // namespace

const char* words_for(ScriptPhase phase) noexcept {
  switch (phase) {
    case ScriptPhase::settling:
      return "to the start and to rest";
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
    : piece_(piece), context_(context), surplus_(first_surplus) {
  plan_strokes();
  for (std::size_t i = 0; i < phases_.size(); ++i) phases_[i] = 1.3 * static_cast<double>(i * i);
}

void ExperimentScript::plan_strokes() {
  const double side = context_.travel_m - start_margin_m;
  switch (piece_.kind) {
    case PieceKind::constant_voltage:
      for (int i = 0; i < piece_.repeats; ++i)
        for (const double v : piece_.voltages_v)
          for (const double s : {1.0, -1.0})
            strokes_.push_back({Kind::constant, -s * side, s * v, longest_stretch_s});
      break;
    case PieceKind::ramp:
      for (int i = 0; i < piece_.repeats; ++i)
        for (const double s : {1.0, -1.0}) strokes_.push_back({Kind::ramp, 0.0, s, 0.0});
      break;
    case PieceKind::coast:
      for (int i = 0; i < piece_.repeats; ++i)
        for (const double v : piece_.voltages_v)
          for (const double s : {1.0, -1.0})
            strokes_.push_back({Kind::push, -0.7 * s * side, s * v, piece_.push_s});
      break;
    case PieceKind::square_wave:
      strokes_.push_back({Kind::square, 0.0, piece_.amplitude_v, piece_.duration_s});
      break;
    case PieceKind::multisine:
      strokes_.push_back({Kind::multisine, 0.0, piece_.amplitude_v, piece_.duration_s});
      break;
    case PieceKind::slow_sine:
      strokes_.push_back({Kind::sine, 0.0, 0.0, piece_.duration_s});
      break;
    case PieceKind::free_decay:
      strokes_.push_back({Kind::decay, 0.0, 0.0, piece_.duration_s});
      break;
    case PieceKind::observe:
      strokes_.push_back({Kind::observe, 0.0, 0.0, piece_.duration_s});
      break;
    case PieceKind::closed_loop:
      strokes_.push_back(
          {Kind::balance, 0.0, 0.0, piece_.hold_s * static_cast<double>(piece_.set_points_m.size())});
      break;
    case PieceKind::delay_sweep:
      strokes_.push_back({Kind::balance, 0.0, 0.0, piece_.duration_s});
      break;
    case PieceKind::sign_check:
      // From low to the largest voltage; a largest one below the first step is the only one.
      for (double v = std::min(2.0 * pulse_step_v, piece_.largest_v);;
           v = std::min(v + pulse_step_v, piece_.largest_v)) {
        for (const double s : {1.0, -1.0}) strokes_.push_back({Kind::pulse, 0.0, s * v, pulse_s});
        if (v >= piece_.largest_v) break;
      }
      break;
  }
}

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
  push_v_ = 0.0;
  arrived_ = false;
}

double ExperimentScript::hanging_lean(const ControlState& now) const noexcept {
  return context_.servo.pendulum_m > 0.0 ? wrapped(now.theta_rad - pi) : 0.0;
}

double ExperimentScript::stop_position_m(const ControlState& now) const noexcept {
  const ServoModel& m = context_.servo;
  const double v = now.cart_velocity_mps;
  const double braking =
      (braking_share * m.force_per_volt_n * std::min(context_.voltage_limit_v, braking_v) + m.sliding_n) /
      m.mass_kg;
  return now.cart_m + v * (reaction_s + 2.0 * context_.period_s) + v * std::abs(v) / (2.0 * braking);
}

bool ExperimentScript::leaves_travel(const ControlState& now) const noexcept {
  const double stop = stop_position_m(now);
  return std::abs(stop) > context_.travel_m && stop * now.cart_velocity_mps > 0.0;
}

/// Voltage that gives the cart a velocity: feed-forward of damping and friction, proportional on the error,
/// and a growing push where it sticks.
double ExperimentScript::servo(double speed_mps, const ControlState& now) noexcept {
  const ServoModel& m = context_.servo;
  const double v = now.cart_velocity_mps;
  double friction = 0.0;
  if (std::abs(v) > standing_mps) {
    friction = m.sliding_n * sign(v);
    push_v_ *= std::max(0.0, 1.0 - 10.0 * elapsed_s_);
  } else if (speed_mps != 0.0) {
    friction = 1.05 * m.breakaway_n * sign(speed_mps);
    push_v_ = std::clamp(push_v_ + push_gain * speed_mps * elapsed_s_, -most_push_v, most_push_v);
  }
  const double gain = servo_bandwidth_radps * m.mass_kg / m.force_per_volt_n;
  return (m.damping_n_per_mps * speed_mps + friction) / m.force_per_volt_n + gain * (speed_mps - v) + push_v_;
}

bool ExperimentScript::at_rest(const ControlState& now) const noexcept {
  if (std::abs(now.cart_velocity_mps) > rest_mps) return false;
  if (context_.servo.pendulum_m == 0.0) return true;
  return std::abs(hanging_lean(now)) < rest_lean_rad && std::abs(now.pendulum_rate_radps) < rest_radps;
}

Demand ExperimentScript::settle(const ControlState& now) noexcept {
  const bool last = stroke_ == strokes_.size();
  const double target = last ? 0.0 : strokes_[stroke_].start_m;
  const double off_m = std::abs(now.cart_m - target);
  arrived_ = off_m < place_tolerance_m || (arrived_ && off_m < springs_back_m);
  if (arrived_ && at_rest(now)) {
    push_v_ = 0.0;
    still_s_ += elapsed_s_;
    if (still_s_ > rest_s) {
      if (last) return finish_stroke();
      const Kind kind = strokes_[stroke_].kind;
      if (kind == Kind::balance)
        enter(piece_.start == StartBy::swing_up ? ScriptPhase::swinging_up : ScriptPhase::waiting);
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
    speed -=
        2.0 * swing_damping * std::sqrt(m.gravity_mps2 * m.pendulum_m) * elementary::sin(hanging_lean(now));
  speed = std::clamp(speed, -fastest_approach_mps, fastest_approach_mps);
  if (leaves_travel(now)) speed = 0.0;
  const double voltage = servo(speed, now);
  // Beyond its travel, where a fall may have left it, nothing pushes the cart farther out.
  const bool pushes_out = std::abs(now.cart_m) > context_.travel_m && voltage * now.cart_m > 0.0;
  Demand demand = put(pushes_out ? 0.0 : voltage);
  demand.homing = true;
  return demand;
}

Demand ExperimentScript::wait(const ControlState& now) noexcept {
  bool ready = std::abs(now.cart_velocity_mps) < rest_mps;
  switch (strokes_[stroke_].kind) {
    case Kind::decay:
      ready = ready && std::abs(hanging_lean(now)) > 0.8 * piece_.angle_rad &&
              std::abs(now.pendulum_rate_radps) < rest_radps;
      break;
    case Kind::balance:
      ready = ready && std::abs(wrapped(now.theta_rad)) < held_lean_rad &&
              std::abs(now.pendulum_rate_radps) < held_radps && std::abs(now.cart_m) < context_.travel_m;
      break;
    default:
      ready = ready && std::abs(hanging_lean(now)) < rest_lean_rad &&
              std::abs(now.pendulum_rate_radps) < rest_radps;
      break;
  }
  still_s_ = ready ? still_s_ + elapsed_s_ : 0.0;
  Demand demand = put(0.0);
  if (still_s_ > held_s) {
    if (strokes_[stroke_].kind == Kind::balance) return engage(now);
    enter(ScriptPhase::acting);
    origin_m_ = now.cart_m;
  } else if (phase_s_ > piece_.patience_s) {
    demand.timed_out = true;
  }
  return demand;
}

/// The feedback takes over from here.
Demand ExperimentScript::engage(const ControlState& now) noexcept {
  enter(ScriptPhase::acting);
  acted_s_ = 0.0;
  upright_rad_ = 2.0 * pi * std::round(now.theta_rad / (2.0 * pi));
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
    upright_rad_ = 2.0 * pi * std::round(now.theta_rad / (2.0 * pi));
    former_rate_ = former_lean_ = 0.0;
    return catch_upright(now);
  }
  const ServoModel& m = context_.servo;
  if (phase_s_ > piece_.patience_s) {
    Demand demand = put(0.0);
    demand.timed_out = true;
    return demand;
  }
  const double lean = wrapped(now.theta_rad);
  const bool high = std::abs(lean) < 1.2;
  if (high && now.pendulum_rate_radps * former_rate_ < 0.0) surplus_ += surplus_step;
  if (high && lean * former_lean_ < 0.0) surplus_ -= surplus_step;
  surplus_ = std::clamp(surplus_, -most_surplus, most_surplus);
  former_rate_ = now.pendulum_rate_radps;
  former_lean_ = lean;
  if (leaves_travel(now)) return put(servo(0.0, now));
  const auto [s, c] = elementary::sine_and_cosine(now.theta_rad);
  const double w = now.pendulum_rate_radps;
  const double energy = 0.5 * w * w + m.gravity_mps2 / m.pendulum_m * (c - 1.0 - surplus_);
  const double pumping = w * c;
  double pump = pump_gain * energy * pumping / (std::abs(pumping) + 0.3);
  pump = std::clamp(pump, -most_pump_mps2, most_pump_mps2);
  // A hanging pendulum at rest gives no direction: any will do.
  if (std::abs(w) < 0.05 && c < -0.99) pump = most_pump_mps2;
  const double wanted = pump - centring_per_s2 * now.cart_m - centring_per_s * now.cart_velocity_mps;
  const double turning = (m.gravity_mps2 * s - c * wanted) / m.pendulum_m;
  const double force =
      m.mass_kg * (wanted + m.reaction_m * (c * turning - s * w * w)) +
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
    return put(servo(0.0, now));
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
  const Stroke& stroke = strokes_[stroke_];
  Demand demand;
  demand.reference_rad = upright_rad_;
  if (!piece_.set_points_m.empty()) {
    const auto at = static_cast<std::size_t>(acted_s_ / piece_.hold_s);
    demand.reference_m = piece_.set_points_m[std::min(at, piece_.set_points_m.size() - 1)];
  }
  if (acted_s_ >= stroke.duration_s) {
    enter(ScriptPhase::over);
    demand = put(0.0);
    demand.over = true;
  }
  acted_s_ += elapsed_s_;
  return demand;
}

/// The voltage of a stretch at `acted_s_`.
double ExperimentScript::excitation(const Stroke& stroke, const ControlState& now) noexcept {
  const double t = acted_s_;
  const double breakaway_v = context_.servo.breakaway_n / context_.servo.force_per_volt_n;
  switch (stroke.kind) {
    case Kind::constant:
      if (t < kick_s) return sign(stroke.voltage_v) * std::max(std::abs(stroke.voltage_v), 1.2 * breakaway_v);
      return stroke.voltage_v;
    case Kind::ramp:
      return stroke.voltage_v * piece_.rate_v_per_s * t;
    case Kind::push:
      return pushed_ ? 0.0 : stroke.voltage_v;
    case Kind::pulse:
      return t < stroke.duration_s ? stroke.voltage_v : 0.0;
    case Kind::square: {
      // A quarter of a period first, so that the cart swings about where it starts.
      const double turns = t / piece_.period_s + 0.25;
      return turns - std::floor(turns) < 0.5 ? stroke.voltage_v : -stroke.voltage_v;
    }
    case Kind::multisine: {
      double sum = 0.0;
      const double ratio = elementary::power(piece_.highest_hz / piece_.lowest_hz, 1.0 / (piece_.lines - 1));
      double frequency = piece_.lowest_hz;
      for (int i = 0; i < piece_.lines; ++i, frequency *= ratio)
        sum += elementary::sin(2.0 * pi * frequency * t + phases_[static_cast<std::size_t>(i)]);
      return std::clamp(2.0 * sum / piece_.lines, -1.0, 1.0) * stroke.voltage_v;
    }
    case Kind::sine: {
      const double omega = 2.0 * pi / piece_.period_s;
      const double wanted_m = piece_.amplitude_m * elementary::sin(omega * t);
      return servo(
          piece_.amplitude_m * omega * elementary::cos(omega * t) + approach_per_s * (wanted_m - now.cart_m),
          now);
    }
    case Kind::observe:
    case Kind::decay:
    case Kind::balance:
      break;
  }
  return 0.0;
}

Demand ExperimentScript::act(const ControlState& now) noexcept {
  const Stroke& stroke = strokes_[stroke_];
  if (stroke.kind == Kind::balance) return balance(now);
  const double moved_m = std::abs(now.cart_m - origin_m_);
  bool done = acted_s_ >= stroke.duration_s;
  switch (stroke.kind) {
    case Kind::ramp:
      done = std::abs(now.cart_velocity_mps) > breakaway_seen_mps || moved_m > breakaway_seen_m ||
             piece_.rate_v_per_s * acted_s_ > piece_.largest_v;
      break;
    case Kind::push: {
      // Zero volts as soon as the coasting cart would just stay within its travel.
      const ServoModel& m = context_.servo;
      const double v = now.cart_velocity_mps;
      const double coast_m = m.damping_n_per_mps > 0.0 ? v * m.mass_kg / m.damping_n_per_mps : 0.0;
      pushed_ =
          pushed_ || acted_s_ >= stroke.duration_s || std::abs(now.cart_m + coast_m) > context_.travel_m;
      done = acted_s_ >= stroke.duration_s + coast_s ||
             (pushed_ && acted_s_ > 0.1 && std::abs(v) < standing_mps);
      break;
    }
    case Kind::pulse:
      farthest_m_ = std::max(farthest_m_, moved_m);
      done = acted_s_ >= stroke.duration_s + after_pulse_s;
      if (done && farthest_m_ > pulse_felt_m) ++pulses_felt_;
      if (moved_m > context_.travel_m) {
        Demand demand = put(0.0);
        demand.timed_out = true;
        return demand;
      }
      break;
    default:
      break;
  }
  const bool driven =
      stroke.kind != Kind::observe && stroke.kind != Kind::decay && stroke.kind != Kind::pulse;
  if (driven && leaves_travel(now)) {
    if (stroke.kind == Kind::square || stroke.kind == Kind::multisine || stroke.kind == Kind::sine)
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
    if (!driven) return finish_stroke();
    enter(ScriptPhase::braking);
    return brake(now);
  }
  const Demand demand = put(excitation(stroke, now));
  acted_s_ += elapsed_s_;
  return demand;
}

Demand ExperimentScript::brake(const ControlState& now) noexcept {
  if (std::abs(now.cart_velocity_mps) < standing_mps) {
    if (ended_) return finish_stroke();
    enter(ScriptPhase::settling);
    return put(0.0);
  }
  return put(servo(0.0, now));
}

/// On to the next stretch, or to the end.
Demand ExperimentScript::finish_stroke() noexcept {
  Demand demand = put(0.0);
  const bool was_centring = stroke_ == strokes_.size();
  const Kind kind = was_centring ? Kind::observe : strokes_[stroke_].kind;
  if (!was_centring) ++stroke_;
  // Two pulses in a row that moved the cart are enough.
  if (kind == Kind::pulse && pulses_felt_ >= 2 && stroke_ % 2 == 0) stroke_ = strokes_.size();
  acted_s_ = 0.0;
  farthest_m_ = 0.0;
  pushed_ = ended_ = false;
  const bool hands_off = kind == Kind::decay || kind == Kind::observe || kind == Kind::pulse;
  if (was_centring || (stroke_ == strokes_.size() && hands_off)) {
    enter(ScriptPhase::over);
    demand.over = true;
    return demand;
  }
  enter(kind == Kind::pulse ? ScriptPhase::waiting : ScriptPhase::settling);
  return demand;
}

Demand ExperimentScript::next(std::uint64_t tick, const ControlState& now) noexcept {
  elapsed_s_ = started_ ? static_cast<double>(tick - tick_) * context_.period_s : context_.period_s;
  tick_ = tick;
  if (!started_) {
    started_ = true;
    switch (strokes_.front().kind) {
      case Kind::observe:
        enter(ScriptPhase::acting);
        break;
      case Kind::decay:
      case Kind::pulse:
        enter(ScriptPhase::waiting);
        break;
      case Kind::balance:
        // Upright already, within the travel: nothing to settle.
        if (std::abs(now.cart_m) > context_.travel_m)
          enter(ScriptPhase::settling);
        else if (piece_.start == StartBy::swing_up)
          enter(can_catch(now) ? ScriptPhase::swinging_up : ScriptPhase::settling);
        else
          enter(std::abs(wrapped(now.theta_rad)) < 2.0 * held_lean_rad ? ScriptPhase::waiting
                                                                       : ScriptPhase::settling);
        break;
      default:
        break;
    }
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
