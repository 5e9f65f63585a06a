// The controllers of runs side by side: estimator, delay, feedback, amplifier limit, input delay. Apart from
// the physics, of which there are many kinds: so it is compiled once for each kind of mask.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "control/whole_periods.hpp"
#include "lane_builds.hpp"
#include "lane_motor.hpp"
#include "lane_observer.hpp"
#include "lane_ring.hpp"
#include "upright/control/delay_line.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

/// Feedback voltages on their way. The feedback is linear, so that delaying the voltage is delaying the
/// state.
template <class Mask>
class LaneDelay {
 public:
  LaneDelay(double longest_delay_s, double period_s)
      : period_s_(period_s), ring_(DelayLine(longest_delay_s, period_s).whole_periods() + 1) {}

  /// Gives one lane this delay.
  void take(std::size_t lane, double delay_s) {
    const DelayLine line(delay_s, period_s_);
    whole_[lane] = static_cast<std::uint32_t>(line.whole_periods());
    put(fraction_, lane, line.fraction());
    same_ = std::all_of(whole_.begin(), whole_.end(), [this](std::size_t of) { return of == whole_[0]; });
    exact_ = exact_ && line.exact();
  }

  void start(const Mask& lanes, const Lanes& volts) { ring_.fill(lanes, volts); }

  Lanes pass(const Mask& lanes, const Lanes& volts) {
    ring_.push(lanes, volts);
    const Lanes later = back(0);
    if (exact_) return later;
    return later + fraction_ * (back(1) - later);
  }

 private:
  Lanes back(std::uint32_t more) const {
    return same_ ? ring_.ago(whole_[0] + more) : ring_.ago(whole_, more);
  }

  double period_s_;
  LaneRing<Mask> ring_;
  std::array<std::uint32_t, lane_count> whole_{};
  Lanes fraction_;
  bool same_ = true, exact_ = true;
};

/// The plant's own input delay, the same for all lanes. Before the first command zero volts are commanded.
template <class Mask>
class LaneInput {
 public:
  LaneInput(const Dynamics<Lanes>& chain, double period_s)
      : delay_(whole_periods(chain.input_delay_s().values()[0], period_s)),
        period_s_(period_s),
        drives_(delay_.whole + 1) {}

  void start(const Mask& lanes, const Lanes& resting_v) { drives_.fill(lanes, resting_v); }

  LaneDrive pass(const Mask& lanes, const Lanes& drive_v) {
    if (delay_.whole == 0 && delay_.fraction == 0.0) return {drive_v, drive_v, 0.0, period_s_};
    drives_.push(lanes, drive_v);
    const double early_s = delay_.fraction * period_s_;
    return {drives_.ago(delay_.whole + 1), drives_.ago(delay_.whole), early_s, period_s_ - early_s};
  }

 private:
  WholePeriods delay_;
  double period_s_;
  LaneRing<Mask> drives_;
};

[[gnu::always_inline]] inline EveryLane narrowed(EveryLane lanes, const LaneMask& /*to*/) {
  return lanes;
}
[[gnu::always_inline]] inline LaneMask narrowed(const LaneMask& lanes, const LaneMask& to) {
  return lanes & to;
}

/// One controller for each lane.
template <class Mask>
class LaneController {
 public:
  LaneController(const LoopSetup& setup, const LaneParts& parts, const PlantModel<Lanes>& model,
                 double longest_delay_s)
      : limit_(setup.amplifier_limit_v),
        chain_(model),
        observer_(setup, parts, longest_delay_s),
        delay_(longest_delay_s, setup.control.period_s()),
        input_(chain_, setup.control.period_s()) {}

  /// Of one lane, before its run begins.
  void take_delay(std::size_t lane, double delay_s) {
    observer_.take_delay(lane, delay_s);
    delay_.take(lane, delay_s);
  }

  /// The plants of all lanes, with the sensors and the actuator chain that are controlled.
  void take_plant(const PlantModel<Lanes>& model) { chain_ = Dynamics<Lanes>(model); }

  bool motor_lags() const { return chain_.has_motor_lag(); }
  Lanes command_v() const { return command_; }

  /// Takes a sample of these lanes, of which `first` are at the start of their runs. Returns what drives the
  /// motors over the next period.
  [[gnu::flatten, gnu::noinline]] LaneDrive take(const Mask& lanes, const LaneMask& first,
                                                 const PlantState<Lanes>& state) {
    const Outputs<Lanes> shown = chain_.measure(state);
    const Mask starting = narrowed(lanes, first), going = narrowed(lanes, !first);
    const bool some_start = any(lanes & first);
    Lanes newest;
    if (any(lanes & !first)) newest = observer_.take(going, shown, command_);
    if (some_start) {
      const Lanes held = observer_.start(starting, shown);
      newest = select(starting, held, newest);
      delay_.start(starting, held);
      input_.start(starting, chain_.actuate(Lanes(0.0)));
      command_ = select(starting, Lanes(0.0), command_);
    }
    const Lanes wanted = observer_.command_v(lanes, delay_.pass(lanes, newest), command_);
    command_ = select(lanes, smaller(larger(wanted, -limit_), limit_), command_);
    return input_.pass(lanes, chain_.actuate(command_));
  }

 private:
  Lanes limit_;
  Dynamics<Lanes> chain_;
  LaneObserver<Mask> observer_;
  LaneDelay<Mask> delay_;
  LaneInput<Mask> input_;
  Lanes command_;
};

}  // namespace upright
