// Method of steps with Dormand and Prince's 5(4) pair. Every lane has its own adaptive step, at most the
// delay, so that the signal it looks back at is always known. Steps end where a derivative of the delayed
// signal jumps: the start and every stick or breakaway come back through the delay.
#include "continuous_lanes.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "lane_history.hpp"
#include "lane_model.hpp"
#include "upright/sim/contacts.hpp"

namespace upright {

namespace {

using Values = std::array<double, lane_count>;
using State = PlantState<Lanes>;

constexpr double infinite = std::numeric_limits<double>::infinity();

/// V = gains . what the sensors show, as factors of the state.
struct FeedbackLine {
  double cart_m, theta_rad, cart_mps, theta_radps, offset_v;

  FeedbackLine(const Gains& gains, const Dynamics<Lanes>& physics) {
    const SensorLine<Lanes> line(physics.model());
    const double cart_gain = line.cart_gain.values()[0], theta_gain = line.theta_gain.values()[0];
    cart_m = gains.cart_position_v_per_m * cart_gain;
    theta_rad = gains.pendulum_angle_v_per_rad * theta_gain;
    cart_mps = gains.cart_velocity_v_per_mps * cart_gain;
    theta_radps = gains.pendulum_rate_v_per_radps * theta_gain;
    offset_v = gains.cart_position_v_per_m * line.cart_offset_m.values()[0] +
               gains.pendulum_angle_v_per_rad * line.theta_offset_rad.values()[0];
  }

  Lanes of_change(const State& s) const {
    return Lanes(cart_m) * s.cart_m + Lanes(theta_rad) * s.theta_rad + Lanes(cart_mps) * s.cart_mps +
           Lanes(theta_radps) * s.theta_radps;
  }
  Lanes operator()(const State& s) const { return Lanes(offset_v) + of_change(s); }
};

/// The cubic through values and slopes (times the step) at both ends, at u in [0, 1].
template <class S>
S hermite(const S& from, const S& slope, const S& to, const S& end_slope, const S& u) {
  const S rise = to - from;
  return from + u * (rise + (u - S(1.0)) * ((slope - rise) * (u - S(1.0)) + (end_slope - rise) * u));
}

/// Where in a step the derivative, taken as a line between its ends, vanishes; 1 where it does not.
Lanes turning_point(const Lanes& slope, const Lanes& end_slope) {
  const LaneMask turns = slope * end_slope < Lanes(0.0);
  return select(turns, slope / select(turns, slope - end_slope, Lanes(1.0)), Lanes(1.0));
}

/// The first root of the cubic within (0, 1), given that it has different signs at the ends.
double first_root(double from, double slope, double to, double end_slope) {
  double low = 0.0, high = 1.0;
  for (int i = 0; i < 60 && high - low > 1e-15; ++i) {
    const double middle = 0.5 * (low + high);
    const double value = hermite(from, slope, to, end_slope, middle);
    ((value > 0.0) == (from > 0.0) ? low : high) = middle;
  }
  return high;
}

/// Times at which a lane's step must end. A jump in a derivative of the signal comes back with every delay,
/// each time in one derivative higher.
class Stops {
 public:
  void start(double delay_s) {
    delay_s_ = delay_s;
    list_.clear();
    jump(0.0, 1);
  }
  void jump(double time_s, int order) {
    if (order > highest_order || delay_s_ == 0.0) return;
    const Stop next{time_s + delay_s_, order};
    list_.insert(std::upper_bound(list_.begin(), list_.end(), next,
                                  [](const Stop& a, const Stop& b) { return a.time_s < b.time_s; }),
                 next);
  }
  /// The next one after `time_s`, having let go of those before.
  double after(double time_s) {
    while (!list_.empty() && list_.front().time_s <= time_s + same_s) {
      const Stop passed = list_.front();
      list_.erase(list_.begin());
      jump(passed.time_s, passed.order + 1);
    }
    return list_.empty() ? infinite : list_.front().time_s;
  }
  static constexpr double same_s = 1e-12;

 private:
  struct Stop {
    double time_s;
    int order;
  };
  static constexpr int highest_order = 3;  // of higher jumps the control of the step takes care
  double delay_s_ = 0.0;
  std::vector<Stop> list_;
};

/// The physics, whatever its effects: so that the method is not compiled for each set.
struct Physics {
  /// Of a state, a motor voltage, and the direction of a cart that may stick.
  std::function<State(const State&, const Lanes&, const Lanes&)> rate;
  std::function<Excess(const State&, const Lanes&)> excess_load;  ///< of a cart that may stick
};

template <class Present>
[[gnu::flatten, gnu::noinline]] State sliding_rate(const Dynamics<Lanes, Present>& physics, const State& s,
                                                   const Lanes& motor_v, const Lanes& direction) {
  return physics.derivative_by_direction(s, motor_v, direction);
}

template <class Present>
Physics sliding_physics(const PlantModel<Lanes>& model, const Present& present) {
  const Dynamics<Lanes, Present> physics(model, present);
  return {[physics](const State& s, const Lanes& motor_v, const Lanes& direction) {
            return sliding_rate(physics, s, motor_v, direction);
          },
          [physics](const State& s, const Lanes& motor_v) { return excess_load(physics, s, motor_v); }};
}

Physics smooth_physics(const PlantModel<Lanes>& model, const EffectSet& present) {
  return {[rate = smooth_rate_of(model, present)](const State& s, const Lanes& motor_v,
                                                  const Lanes& /*direction*/) { return rate(s, motor_v); },
          {}};
}

template <bool has_bristles, bool sticks>
class ContinuousRuns {
 public:
  ContinuousRuns(const LoopSetup& setup, const PlantModel<Lanes>& model, Physics physics, LoopSource& source)
      : setup_(setup),
        chain_(model),
        physics_(std::move(physics)),
        feedback_(setup.control.gains, chain_),
        input_delay_s_(chain_.input_delay_s().values()[0]),
        source_(source) {
    for (std::size_t lane = 0; lane < lane_count; ++lane) rest(lane);
  }

  void run() {
    fill();
    while (active_ != 0) step();
  }

 private:
  /// Why a step is shorter than its errors would have it.
  enum class Cut : std::uint8_t { no, before_stop, before_breakaway };

  // Errors per step of an angle or position, and of velocities in proportion to the loop's frequencies.
  static constexpr double tolerance_m = 3e-9, tolerance_rad = 3e-9, rates_per_s = 20.0;
  static constexpr double longest_step_s = 0.02, first_step_s = 2e-4, shortest_step_s = 1e-10;
  static constexpr double shortest_delay_s = 1e-6;  // below it a delay counts as none, as in ContinuousLoop
  static constexpr double at_rest_mps = 1e-9;       // a cart this slow may stop
  static constexpr double at_edge_n = 1e-9;         // a load this near to what friction holds breaks away

  Lanes motor(const Lanes& time_s, const State& s) {
    Lanes volts = history_.at(time_s - Lanes::load(delay_s_.data()));
    if (any_undelayed_) volts = select(Lanes::load(delay_s_.data()) > Lanes(0.0), volts, feedback_(s));
    return chain_.actuate(volts);
  }

  State rate(const State& s, const Lanes& motor_v) const {
    return physics_.rate(s, motor_v, Lanes::load(direction_.data()));
  }

  template <class F>
  static void each(State& s, const F& of) {
    s.cart_m = of(&State::cart_m);
    s.theta_rad = of(&State::theta_rad);
    s.cart_mps = of(&State::cart_mps);
    s.theta_radps = of(&State::theta_radps);
    if constexpr (has_bristles) s.bristle_m = of(&State::bristle_m);
  }

  // Not split, nor find_events and watch: with contracted multiply-adds a split may change last digits.
  void step() {
    const Lanes begin_s = Lanes::load(time_s_.data()), h = Lanes::load(step_s_.data());
    if (stale_ != 0) renew_rates(begin_s);
    const State y = y_, k1 = k1_;
    const auto stage = [&](double c, const auto& combination) {
      State at{};
      each(at, [&](Lanes State::*of) { return y.*of + h * combination(of); });
      return rate(at, motor(begin_s + Lanes(c) * h, at));
    };
    const State k2 = stage(0.2, [&](Lanes State::*of) { return Lanes(0.2) * (k1.*of); });
    const State k3 = stage(
        0.3, [&](Lanes State::*of) { return Lanes(3.0 / 40.0) * (k1.*of) + Lanes(9.0 / 40.0) * (k2.*of); });
    const State k4 = stage(0.8, [&](Lanes State::*of) {
      return Lanes(44.0 / 45.0) * (k1.*of) + Lanes(-56.0 / 15.0) * (k2.*of) + Lanes(32.0 / 9.0) * (k3.*of);
    });
    const State k5 = stage(8.0 / 9.0, [&](Lanes State::*of) {
      return Lanes(19372.0 / 6561.0) * (k1.*of) + Lanes(-25360.0 / 2187.0) * (k2.*of) +
             Lanes(64448.0 / 6561.0) * (k3.*of) + Lanes(-212.0 / 729.0) * (k4.*of);
    });
    const Lanes end_s = begin_s + h;
    State last{};
    each(last, [&](Lanes State::*of) {
      return y.*of + h * (Lanes(9017.0 / 3168.0) * (k1.*of) + Lanes(-355.0 / 33.0) * (k2.*of) +
                          Lanes(46732.0 / 5247.0) * (k3.*of) + Lanes(49.0 / 176.0) * (k4.*of) +
                          Lanes(-5103.0 / 18656.0) * (k5.*of));
    });
    const Lanes late_v = motor(end_s, last);
    const State k6 = rate(last, late_v);
    State end{};
    each(end, [&](Lanes State::*of) {
      return y.*of + h * (Lanes(35.0 / 384.0) * (k1.*of) + Lanes(500.0 / 1113.0) * (k3.*of) +
                          Lanes(125.0 / 192.0) * (k4.*of) + Lanes(-2187.0 / 6784.0) * (k5.*of) +
                          Lanes(11.0 / 84.0) * (k6.*of));
    });
    const Lanes end_v = any_undelayed_ ? motor(end_s, end) : late_v;
    const State k7 = rate(end, end_v);
    const auto error = [&](Lanes State::*of) {
      return absolute(h * (Lanes(71.0 / 57600.0) * (k1.*of) + Lanes(-71.0 / 16695.0) * (k3.*of) +
                           Lanes(71.0 / 1920.0) * (k4.*of) + Lanes(-17253.0 / 339200.0) * (k5.*of) +
                           Lanes(22.0 / 525.0) * (k6.*of) + Lanes(-1.0 / 40.0) * (k7.*of)));
    };
    Lanes worst = larger(Lanes(1.0 / tolerance_m) * error(&State::cart_m),
                         Lanes(1.0 / tolerance_rad) * error(&State::theta_rad));
    worst = larger(worst, Lanes(1.0 / (rates_per_s * tolerance_m)) * error(&State::cart_mps));
    worst = larger(worst, Lanes(1.0 / (rates_per_s * tolerance_rad)) * error(&State::theta_radps));
    if constexpr (has_bristles) worst = larger(worst, Lanes(1.0 / tolerance_m) * error(&State::bristle_m));
    worst = select(worst < Lanes(1e10), worst, Lanes(1e10));  // not a number, too
    const Lanes proposed = h * smaller(Lanes(5.0), larger(Lanes(0.2), Lanes(0.9) * fifth_root(worst)));
    LaneMask good = (worst <= Lanes(1.0)) | (h <= Lanes(shortest_step_s));
    std::uint32_t accepted = good.bits() & active_;
    proposed.store(proposed_s_.data());
    if constexpr (sticks) accepted = find_events(accepted, begin_s, h, y, k1, end, k7, end_v);
    refuse(active_ & ~accepted);
    if (accepted == 0) return;

    const std::array values = {feedback_(y), feedback_(end)};
    const auto slope = [&](const State& k) { return h * feedback_.of_change(k); };
    const Lanes rise = values[1] - values[0], first = slope(k1), bend = first - rise;
    const Lanes fourth =
        Lanes(-12715105075.0 / 11282082432.0) * first + Lanes(87487479700.0 / 32700410799.0) * slope(k3) +
        Lanes(-10690763975.0 / 1880347072.0) * slope(k4) +
        Lanes(701980252875.0 / 199316789632.0) * slope(k5) + Lanes(-1453857185.0 / 822651844.0) * slope(k6) +
        Lanes(69997945.0 / 29380423.0) * slope(k7);
    history_.add(accepted, begin_s, end_s, Lanes(1.0) / h,
                 {values[0], rise, bend, rise - slope(k7) - bend, fourth});
    watch(accepted, begin_s, h, y, k1, end, k7);
    move_on(accepted, end_s, end, k7);
  }

  /// x^(-1/5) for x > 0.
  static Lanes fifth_root(const Lanes& x) { return exp(Lanes(-0.2) * log(larger(x, Lanes(1e-10)))); }

  /// Rates anew for lanes that start or whose contact changed; a cart at rest settles which way it goes.
  void renew_rates(const Lanes& time_s) {
    const Lanes motor_v = motor(time_s, y_);
    if constexpr (sticks) {
      const Excess excess = physics_.excess_load(y_, motor_v);
      const Values settled = upright::direction_of(excess).values(),
                   over = larger(excess.forward, excess.backward).values(), v = y_.cart_mps.values();
      for (std::uint32_t lanes = stale_; lanes != 0; lanes &= lanes - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
        excess_n_[i] = over[i];
        direction_[i] = v[i] > 0.0                     ? 1.0
                        : v[i] < 0.0                   ? -1.0
                        : budget_[i].spent(time_s_[i]) ? 0.0
                                                       : settled[i];
      }
    }
    const State fresh = rate(y_, motor_v);
    const LaneMask mine = lanes_of(stale_);
    each(k1_, [&](Lanes State::*of) { return select(mine, fresh.*of, k1_.*of); });
    stale_ = 0;
  }

  static LaneMask lanes_of(std::uint32_t bits) {
    Values chosen;
    for (std::size_t i = 0; i < lane_count; ++i) chosen[i] = (bits >> i & 1u) != 0 ? 1.0 : 0.0;
    return Lanes::load(chosen.data()) > Lanes(0.5);
  }

  /// Looks for stops and breakaways within the steps of `accepted`. A step that goes too far past one is
  /// taken again, shorter; returns those that stay. Snaps the velocity of a cart that stopped. Not split: see
  /// `step`. Eight parameters: what the step has computed, in registers.
  std::uint32_t find_events(std::uint32_t accepted, const Lanes& begin_s, const Lanes& h, const State& y,
                            const State& k1, State& end, const State& k7, const Lanes& end_v) {
    const Lanes zero(0.0), direction = Lanes::load(direction_.data());
    const LaneMask rests = direction == zero;
    const Lanes v0 = direction * y.cart_mps, v1 = direction * end.cart_mps;
    const Lanes a0 = direction * k1.cart_mps, a1 = direction * k7.cart_mps;
    const Lanes dip = turning_point(a0, a1);
    const Lanes lowest = hermite(v0, h * a0, v1, h * a1, dip);
    const LaneMask stops = (v1 < zero) | ((v1 < Lanes(at_rest_mps)) & (a1 < zero)) |
                           ((a0 < zero) & (lowest < zero) & (v0 > zero));
    LaneMask eventful = !rests & stops;
    Lanes highest(1.0);  // where in the step the load comes nearest to breaking away
    if (any(rests)) {
      const auto over = [&](const State& at, const Lanes& motor_v) {
        const Excess excess = physics_.excess_load(at, motor_v);
        return larger(excess.forward, excess.backward);
      };
      // The load may rise over the level and sink again within a step: a parabola through three places tells.
      State middle = y;
      const Lanes half(0.5);
      middle.theta_rad = hermite(y.theta_rad, h * k1.theta_rad, end.theta_rad, h * k7.theta_rad, half);
      middle.theta_radps =
          hermite(y.theta_radps, h * k1.theta_radps, end.theta_radps, h * k7.theta_radps, half);
      const Lanes first = Lanes::load(excess_n_.data()), last = over(end, end_v),
                  between = over(middle, motor(begin_s + half * h, middle));
      const Lanes slope = Lanes(4.0) * between - Lanes(3.0) * first - last,
                  bend = Lanes(2.0) * (first + last) - Lanes(4.0) * between;
      const LaneMask arched = (bend < zero) & (slope > zero) & (slope < Lanes(-2.0) * bend) & !(last > zero);
      highest = select(arched, slope / select(arched, Lanes(-2.0) * bend, Lanes(1.0)), Lanes(1.0));
      const Lanes excess = select(arched, first + half * slope * highest, last);
      excess.store(max_excess_n_.data());
      last.store(end_excess_n_.data());
      eventful = eventful | (rests & (excess > zero));
    }
    const std::uint32_t candidates = eventful.bits() & accepted;
    if (candidates == 0) {
      keep_excess(accepted);
      return accepted;
    }
    const Values from = v0.values(), to = v1.values(), slope = a0.values(), end_slope = a1.values(),
                 dips = dip.values(), least = lowest.values(), length = h.values(), peaks = highest.values();
    Values v = end.cart_mps.values();
    for (std::uint32_t lanes = candidates; lanes != 0; lanes &= lanes - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
      const double step = length[i];
      const bool shortest = step <= shortest_step_s;
      if (direction_[i] == 0.0) {
        if (budget_[i].spent(time_s_[i])) continue;
        if (end_excess_n_[i] <= 0.0) {
          if (shortest || max_excess_n_[i] <= at_edge_n) continue;
          proposed_s_[i] = peaks[i] * step;
          cut_[i] = Cut::before_breakaway;
          accepted &= ~(1u << i);
          continue;
        }
        if (end_excess_n_[i] > at_edge_n && !shortest) {
          const double before = std::min(excess_n_[i], 0.0);
          const double part = std::clamp(before / (before - end_excess_n_[i]), 0.02, 0.9);
          proposed_s_[i] = part * step;
          cut_[i] = Cut::before_breakaway;
          accepted &= ~(1u << i);
          continue;
        }
      } else {
        const bool dipped = to[i] > at_rest_mps;
        if (!shortest && (dipped || to[i] < -at_rest_mps)) {
          const double part = !(from[i] > 0.0) ? 0.25
                              : dipped
                                  ? dips[i] * first_root(from[i], dips[i] * step * slope[i], least[i], 0.0)
                                  : first_root(from[i], step * slope[i], to[i], step * end_slope[i]);
          proposed_s_[i] = part * step;
          cut_[i] = Cut::before_stop;
          accepted &= ~(1u << i);
          continue;
        }
        v[i] = 0.0;
      }
      event_ |= 1u << i;
    }
    end.cart_mps = Lanes::load(v.data());
    keep_excess(accepted);
    return accepted;
  }

  void keep_excess(std::uint32_t lanes) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
      excess_n_[i] = end_excess_n_[i];
    }
  }

  void refuse(std::uint32_t lanes) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
      step_s_[i] = std::max(proposed_s_[i], shortest_step_s);
      if (cut_[i] == Cut::no) controlled_step_s_[i] = step_s_[i];
    }
  }

  /// Extremes of the motion over the steps, and falls. Seven parameters: as for `find_events`.
  void watch(std::uint32_t accepted, const Lanes& begin_s, const Lanes& h, const State& y, const State& k1,
             const State& end, const State& k7) {
    const Lanes theta = hermite(y.theta_rad, h * k1.theta_rad, end.theta_rad, h * k7.theta_rad,
                                turning_point(k1.theta_rad, k7.theta_rad));
    const Lanes cart =
        hermite(y.cart_m, h * k1.cart_m, end.cart_m, h * k7.cart_m, turning_point(k1.cart_m, k7.cart_m));
    const LaneMask mine = lanes_of(accepted);
    const LaneMask fallen =
        mine & !(larger(absolute(theta), absolute(end.theta_rad)) < Lanes(setup_.fell_above_rad));
    fallen_ = fallen.bits();
    const LaneMask late = mine & (begin_s >= Lanes(setup_.window_begin_s() - Stops::same_s));
    const auto widen = [&](Lanes& low, Lanes& high, const Lanes& a, const Lanes& b, const Lanes& c) {
      low = select(late, smaller(low, smaller(a, smaller(b, c))), low);
      high = select(late, larger(high, larger(a, larger(b, c))), high);
    };
    widen(theta_low_, theta_high_, y.theta_rad, theta, end.theta_rad);
    widen(cart_low_, cart_high_, y.cart_m, cart, end.cart_m);
    if (fallen_ != 0) note_falls(begin_s, h, y, k1, end, k7);
    cart_max_ = select(mine, larger(cart_max_, larger(absolute(cart), absolute(end.cart_m))), cart_max_);
  }

  void note_falls(const Lanes& begin_s, const Lanes& h, const State& y, const State& k1, const State& end,
                  const State& k7) {
    const auto value = [](const Lanes& a, std::size_t i) { return a.values()[i]; };
    for (std::uint32_t lanes = fallen_; lanes != 0; lanes &= lanes - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
      const double step = value(h, i);
      const auto along = [&](Lanes State::*of, double u) {
        return hermite(value(y.*of, i), step * value(k1.*of, i), value(end.*of, i), step * value(k7.*of, i),
                       u);
      };
      double low = 0.0, high = 1.0;
      for (int n = 0; n < 50; ++n) {
        const double middle = 0.5 * (low + high);
        (std::abs(along(&State::theta_rad, middle)) < setup_.fell_above_rad ? low : high) = middle;
      }
      LoopResult result;
      result.fall_time_s = value(begin_s, i) + high * step;
      result.theta_amplitude_rad = setup_.fell_above_rad;
      result.cart_amplitude_m = std::max(value(cart_max_, i), std::abs(along(&State::cart_m, high)));
      result.end = {along(&State::cart_m, high),
                    along(&State::theta_rad, high),
                    along(&State::cart_mps, high),
                    along(&State::theta_radps, high),
                    0.0,
                    has_bristles ? along(&State::bristle_m, high) : 0.0};
      source_.take(number_of_[i], result);
    }
  }

  /// Takes the steps, and sees to what each lane does next.
  void move_on(std::uint32_t accepted, const Lanes& end_s, const State& end, const State& k7) {
    const LaneMask mine = lanes_of(accepted);
    each(y_, [&](Lanes State::*of) { return select(mine, end.*of, y_.*of); });
    each(k1_, [&](Lanes State::*of) { return select(mine, k7.*of, k1_.*of); });
    const Values times = end_s.values();
    const std::uint32_t before = active_;
    for (std::uint32_t lanes = accepted; lanes != 0; lanes &= lanes - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
      time_s_[i] = times[i];
      const bool arrived = times[i] >= stop_s_[i] - Stops::same_s;
      if (arrived) time_s_[i] = stop_s_[i];
      const std::uint32_t bit = 1u << i;
      // A step cut short says nothing against longer ones; only a breakaway is come near to with care.
      if (cut_[i] == Cut::no)
        controlled_step_s_[i] = arrived ? std::max(controlled_step_s_[i], proposed_s_[i]) : proposed_s_[i];
      const bool careful = cut_[i] == Cut::before_breakaway && (event_ & bit) == 0;
      const double wanted_s =
          careful ? std::min(controlled_step_s_[i], 4.0 * step_s_[i]) : controlled_step_s_[i];
      cut_[i] = Cut::no;
      if ((event_ & bit) != 0) {
        budget_[i].spent(time_s_[i]);
        budget_[i].count();
        stale_ |= bit;
        stops_[i].jump(time_s_[i], 1);
        stop_s_[i] = next_stop(i);
      }
      if ((fallen_ & bit) != 0) {
        rest(i);
        continue;
      }
      history_.forget_before(i, time_s_[i] - delay_s_[i]);
      if (arrived) {
        if (time_s_[i] >= setup_.duration_s - Stops::same_s) {
          finish(i);
          rest(i);
          continue;
        }
        stop_s_[i] = next_stop(i);
      }
      choose_step(i, wanted_s);
    }
    event_ = fallen_ = 0;
    if (active_ != before) fill();
  }

  double next_stop(std::size_t i) {
    double next = std::min(stops_[i].after(time_s_[i]), setup_.duration_s);
    const double window_s = setup_.window_begin_s();
    if (time_s_[i] < window_s - Stops::same_s) next = std::min(next, window_s);
    return next;
  }

  void choose_step(std::size_t i, double wanted_s) {
    const double max_step_s = delay_s_[i] > 0.0 ? std::min(longest_step_s, delay_s_[i]) : longest_step_s;
    const double left = stop_s_[i] - time_s_[i];
    double step = std::min(wanted_s, max_step_s);
    if (left <= 1.001 * step && left <= max_step_s)
      step = left;
    else if (left < 2.0 * step)
      step = 0.5 * left;
    step_s_[i] = step;
  }

  void finish(std::size_t i) {
    const auto value = [i](const Lanes& a) { return a.values()[i]; };
    LoopResult result;
    result.theta_amplitude_rad = 0.5 * (value(theta_high_) - value(theta_low_));
    result.cart_amplitude_m = 0.5 * (value(cart_high_) - value(cart_low_));
    result.end = {value(y_.cart_m),   value(y_.theta_rad), value(y_.cart_mps), value(y_.theta_radps), 0.0,
                  value(y_.bristle_m)};
    source_.take(number_of_[i], result);
  }

  /// Gives lanes without a run the next ones, as far as there are.
  void fill() {
    LoopRun run;
    for (std::uint32_t idle = ~active_ & every_lane; idle != 0 && source_.next(run); idle &= idle - 1)
      begin(static_cast<std::size_t>(std::countr_zero(idle)), run);
  }

  void rest(std::size_t i) {
    for (State* state : {&y_, &k1_})
      each(*state, [&](Lanes State::*of) {
        Lanes changed = state->*of;
        put(changed, i, 0.0);
        return changed;
      });
    active_ &= ~(1u << i);
    stale_ &= ~(1u << i);
    time_s_[i] = 0.0;
    step_s_[i] = first_step_s;
    delay_s_[i] = 0.0;
    history_.start_without(i);
  }

  /// Begins a run in a lane at rest.
  void begin(std::size_t i, const LoopRun& run) {
    number_of_[i] = run.number;
    active_ |= 1u << i;
    stale_ |= 1u << i;
    delay_s_[i] = run.start.delay_s + input_delay_s_;
    if (!(delay_s_[i] > shortest_delay_s)) delay_s_[i] = 0.0;
    any_undelayed_ = any_undelayed_ || delay_s_[i] == 0.0;
    put(y_.theta_rad, i, run.start.theta0_rad);
    if (delay_s_[i] > 0.0)
      history_.start(i, 0.0, feedback_(y_).values()[i]);
    else
      history_.start_without(i);
    direction_[i] = 0.0;
    cut_[i] = Cut::no;
    budget_[i].restart(0.0);
    stops_[i].start(delay_s_[i]);
    stop_s_[i] = next_stop(i);
    controlled_step_s_[i] = first_step_s;
    put(theta_low_, i, infinite);
    put(theta_high_, i, -infinite);
    put(cart_low_, i, infinite);
    put(cart_high_, i, -infinite);
    put(cart_max_, i, 0.0);
    choose_step(i, first_step_s);
  }

  static constexpr std::uint32_t every_lane = (1u << lane_count) - 1u;

  const LoopSetup& setup_;
  Dynamics<Lanes> chain_;
  Physics physics_;
  FeedbackLine feedback_;
  double input_delay_s_;
  LoopSource& source_;

  State y_{}, k1_{};
  LaneHistory history_;
  Values time_s_{}, step_s_{}, controlled_step_s_{}, proposed_s_{}, stop_s_{}, delay_s_{};
  Values direction_{}, excess_n_{}, end_excess_n_{}, max_excess_n_{};
  std::array<Cut, lane_count> cut_{};
  std::array<EventBudget, lane_count> budget_;
  std::array<Stops, lane_count> stops_;
  Lanes theta_low_, theta_high_, cart_low_, cart_high_, cart_max_;
  std::array<std::size_t, lane_count> number_of_{};
  std::uint32_t active_ = 0, stale_ = 0, event_ = 0, fallen_ = 0;
  bool any_undelayed_ = false;
};

}  // namespace

void UPRIGHT_LANES::run_continuous_on_lanes(const LoopSetup& setup, const PlantModel<double>& plant,
                                            LoopSource& source) {
  const PlantModel<Lanes> model = on_lanes(plant);
  const bool sticks = Dynamics<Lanes>(model).cart_can_stick();
  with_effects(plant.present, [&]<class Present>(const Present& present) {
    constexpr bool bristles = may_have_bristles<Present>;
    if constexpr (may_stick<Present>)
      if (sticks)
        return ContinuousRuns<bristles, true>(setup, model, sliding_physics(model, present), source).run();
    ContinuousRuns<bristles, false>(setup, model, smooth_physics(model, plant.present), source).run();
  });
}

}  // namespace upright
