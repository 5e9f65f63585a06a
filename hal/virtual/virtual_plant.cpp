#include "virtual_plant.hpp"

#include <algorithm>
#include <numbers>

#include "upright/base/error.hpp"
#include "upright/model/plant_model.hpp"

namespace upright {

namespace {

constexpr std::int64_t trace_every_ns = 1'000'000;
constexpr std::int64_t flush_every_ns = 100'000'000;

PlantState<double> resting_at(const Pose& pose) {
  PlantState<double> state;
  state.cart_m = pose.cart_m;
  state.theta_rad = pose.theta_rad;
  return state;
}

}  // namespace

VirtualPlant::VirtualPlant(const RigFile& rig, const Plant& plant, const VirtualRigOptions& options)
    : calibration_(rig.calibration),
      limit_v_(rig.amplifier.limit_v),
      initial_(resting_at({options.cart0_m, options.theta0_rad})),
      simulator_(make_model<double>(plant)) {
  simulator_.start(initial_);
  if (options.hang_s > 0.0) {
    hang_ns_ = static_cast<std::int64_t>(options.hang_s * 1e9);
    hold_at(std::numbers::pi);
  }
  if (options.trace.empty()) return;
  trace_.open(options.trace);
  if (!trace_)
    throw ConfigError("cannot write " + options.trace.string() + ": check the folder and its permissions");
  trace_ << "monotonic_s,voltage_v,cart_m,theta_rad,held\n";
}

void VirtualPlant::move_to(std::int64_t time_ns) {
  if (!held_) simulator_.advance_to(seconds(time_ns));
  now_ns_ = time_ns;
}

void VirtualPlant::hold_at(double theta_rad) {
  PlantState<double> held = initial_;
  held.theta_rad = theta_rad;
  simulator_.start(held);
}

/// The operator lifts the pendulum in about a second.
void VirtualPlant::lift() {
  if (hang_ns_ == 0 || fed_ns_ == 0) return;
  if (hanging_since_ns_ == 0) hanging_since_ns_ = now_ns_;
  constexpr double lift_s = 1.0;
  const double lifted = static_cast<double>(now_ns_ - hanging_since_ns_ - hang_ns_) * 1e-9 / lift_s;
  if (lifted >= 1.0) hang_ns_ = 0;
  const double part = std::clamp(lifted, 0.0, 1.0);
  hold_at(part * initial_.theta_rad + (1.0 - part) * std::numbers::pi);
}

void VirtualPlant::advance_to(std::int64_t time_ns) {
  if (held_) lift();
  if (voltage_v_ != 0.0 && expires_ns_ <= time_ns) {
    move_to(std::max(expires_ns_, now_ns_));
    command(0.0);
  }
  move_to(time_ns);
}

EncoderCounts VirtualPlant::counts() const {
  const Outputs<double> seen = simulator_.engine().outputs();
  return counts_at(Pose{seen.cart_m, seen.theta_rad}, calibration_);
}

std::array<double, 2> VirtualPlant::counts_per_s() const {
  const PlantState<double>& state = simulator_.engine().state();
  const EncoderCalibration &cart = calibration_.cart, &pendulum = calibration_.pendulum;
  return {state.cart_mps / (cart.sign * cart.per_count),
          state.theta_radps / (pendulum.sign * pendulum.per_count)};
}

void VirtualPlant::command(double voltage_v) {
  const double safe_v = safe_voltage(voltage_v, limit_v_);
  if (safe_v == voltage_v_) return;
  trace(true);
  voltage_v_ = safe_v;
  if (!held_) simulator_.command(seconds(now_ns_), safe_v);
  trace(true);
}

void VirtualPlant::feed(double watchdog_s) {
  fed_ns_ = now_ns_;
  expires_ns_ = now_ns_ + static_cast<std::int64_t>(watchdog_s * 1e9);
}

void VirtualPlant::let_go() {
  if (!held_) return;
  held_ = false;
  let_go_ns_ = now_ns_;
  simulator_.start(PlantState<double>(simulator_.engine().state()), 0.0, 0.0);
  simulator_.command(0.0, voltage_v_);
}

void VirtualPlant::put_back() {
  command(0.0);
  held_ = true;
  simulator_.start(initial_);
}

void VirtualPlant::trace(bool now) {
  if (!trace_.is_open() || (!now && now_ns_ - traced_ns_ < trace_every_ns)) return;
  traced_ns_ = now_ns_;
  const PlantState<double>& state = simulator_.engine().state();
  trace_ << exact_text(static_cast<double>(now_ns_) * 1e-9) << ',' << exact_text(voltage_v_) << ','
         << exact_text(state.cart_m) << ',' << exact_text(state.theta_rad) << ',' << (held_ ? 1 : 0) << '\n';
  if (now_ns_ - flushed_ns_ < flush_every_ns) return;
  flushed_ns_ = now_ns_;
  trace_.flush();
}

}  // namespace upright
