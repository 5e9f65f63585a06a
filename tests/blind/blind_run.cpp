#include "blind_run.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "coloured_noise.hpp"
#include "extra_forces.hpp"
#include "upright/control/controller.hpp"
#include "upright/sim/simulator.hpp"

namespace upright::blind {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double amplifier_limit_v = 10.0;

/// A step of 0: a sensor without quantisation.
double quantised(double value, double step) {
  return step > 0.0 ? step * std::round(value / step) : value;
}

/// Noise of one sensor, white and coloured.
class SensorNoise {
 public:
  SensorNoise(double white, double coloured, double kept, std::uint64_t seed)
      : white_(white), random_(seed), coloured_(coloured, kept, random_) {}

  double next() {
    const double value = coloured_.value() + white_ * normal_(random_);
    coloured_.step(random_);
    return value;
  }

 private:
  double white_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  GaussMarkov coloured_;
};

/// The voltages of a plan, from what the encoders show.
class Driver {
 public:
  Driver(const Plan& plan)
      : plan_(plan), random_(plan.seed), controller_(config_of(plan), amplifier_limit_v) {
    std::uniform_real_distribution<double> phase(0.0, 2.0 * pi), stretch(0.9, 1.1);
    for (std::size_t i = 0; i < phases_.size(); ++i) {
      phases_[i] = phase(random_);
      frequencies_hz_[i] = 0.2 * std::pow(1.87, static_cast<double>(i)) * stretch(random_);
    }
    period_s_ = std::uniform_real_distribution<double>(0.7, 1.5)(random_);
    set_point_m_ = plan.reach * std::uniform_real_distribution<double>(0.03, 0.08)(random_);
  }

  double volts(std::size_t k, double t, double cart_m, double theta_rad) {
    double v = 0.0;
    switch (plan_.experiment) {
      case Experiment::balance:
        return balance(k, t, cart_m, theta_rad);
      case Experiment::multisine:
        for (std::size_t i = 0; i < phases_.size(); ++i)
          v += 0.55 * plan_.amplitude_v * std::sin(2.0 * pi * frequencies_hz_[i] * t + phases_[i]);
        break;
      case Experiment::square:
        if (t < plan_.duration_s - 1.0)
          v = (std::fmod(t, period_s_) < 0.5 * period_s_ ? 1.0 : -1.0) * plan_.amplitude_v *
              (0.5 + 0.7 * t / plan_.duration_s);
        break;
      case Experiment::constant:
        return constant(t, cart_m);
      case Experiment::coast:
        if (t > 1.5) return 0.0;
        v = plan_.amplitude_v * (std::fmod(t, 0.8) < 0.4 ? 1.0 : -1.0);
        break;
      case Experiment::locked_swing:
        return 0.0;
    }
    return limited(v - plan_.centring_v_per_m * cart_m);
  }

 private:
  static ControlConfig config_of(const Plan& plan) {
    ControlConfig config;
    config.gains = {plan.gains[0], plan.gains[1], plan.gains[2], plan.gains[3]};
    config.sample_rate_hz = plan.rate_hz;
    config.delay_s = plan.experiment == Experiment::balance ? plan.loop_delay_s : 0.0;
    config.estimator.cutoff_hz = std::min(50.0, 0.2 * plan.rate_hz);
    return config;
  }

  static double limited(double v) { return std::clamp(v, -amplifier_limit_v, amplifier_limit_v); }

  /// As a real loop does: it stops once the pendulum has fallen.
  double balance(std::size_t k, double t, double cart_m, double theta_rad) {
    constexpr double fall_rad = 0.35;
    stopped_ = stopped_ || std::abs(theta_rad) > fall_rad || (plan_.let_go_s && t > *plan_.let_go_s);
    if (stopped_) return 0.0;
    const double place = std::fmod(t, 2.0 * period_s_) < period_s_ ? 0.0 : set_point_m_;
    return controller_.step({k, cart_m, theta_rad, place}).voltage_v;
  }

  /// A voltage for a while, then none, then the other way; earlier where the track would end.
  double constant(double t, double cart_m) {
    const double track_m = 0.3 * plan_.reach;
    if (t >= until_s_ || (level_ != 0.0 && level_ * cart_m > 0.0 && std::abs(cart_m) > track_m)) {
      const bool pause = level_ != 0.0;
      if (!pause)
        direction_ = std::abs(cart_m) > 0.05 * plan_.reach ? (cart_m > 0.0 ? -1.0 : 1.0) : -direction_;
      std::uniform_real_distribution<double> size(0.4, 1.2), length(0.5, 1.5);
      level_ = pause ? 0.0 : direction_ * size(random_) * plan_.amplitude_v;
      until_s_ = t + (pause ? 0.5 : length(random_));
    }
    return limited(level_);
  }

  const Plan& plan_;
  std::mt19937_64 random_;
  Controller controller_;
  std::array<double, 6> phases_{}, frequencies_hz_{};
  double period_s_ = 1.0, set_point_m_ = 0.05;
  double level_ = 0.0, direction_ = 1.0, until_s_ = 0.0;
  bool stopped_ = false;
};

bool in_gap(const Plan& plan, double t) {
  return std::any_of(plan.gaps_s.begin(), plan.gaps_s.end(),
                     [&](const auto& gap) { return t >= gap.first && t < gap.first + gap.second; });
}

}  // namespace

std::string_view name_of(Unknown unknown) {
  switch (unknown) {
    case Unknown::none:
      return "none";
    case Unknown::encoder_play:
      return "encoder_play";
    case Unknown::gusts:
      return "gusts";
    case Unknown::rough_track:
      return "rough_track";
    case Unknown::velocity_ripple:
      return "velocity_ripple";
    case Unknown::force_drift:
      return "force_drift";
  }
  return "";
}

std::string_view name_of(Experiment experiment) {
  switch (experiment) {
    case Experiment::balance:
      return "balance";
    case Experiment::multisine:
      return "multisine";
    case Experiment::square:
      return "square";
    case Experiment::constant:
      return "constant";
    case Experiment::coast:
      return "coast";
    case Experiment::locked_swing:
      return "locked_swing";
  }
  return "";
}

Measurement measure(const Rig& rig, const Plan& plan, const std::string& name) {
  const bool locked = plan.experiment == Experiment::locked_swing;
  const bool pendulum = rig.plant.pendulum.has_value();
  const ExtraForces extra(rig, plan);
  EngineOptions options;
  options.relative_tolerance = 1e-9;
  BasicSimulator<VaryingEngine, double> simulator(make_model<double>(rig.plant, locked), options);
  if (extra.varies() && (!locked || rig.coloured.torque_nm > 0.0)) simulator.engine().vary(&extra);
  PlantState<double> start;
  if (pendulum)
    start.theta_rad = plan.experiment == Experiment::balance ? plan.swing_rad : pi + plan.swing_rad;
  simulator.start(start);

  Measurement run;
  run.name = name;
  run.cart_locked = locked;
  run.cart_resolution_m = locked ? 0.0 : rig.cart_step_m;
  run.theta_resolution_rad = pendulum ? rig.theta_step_rad : 0.0;
  Driver driver(plan);
  std::mt19937_64 random(plan.seed * 104729 + 3);
  std::normal_distribution<double> normal;
  const double period_s = 1.0 / plan.rate_hz;
  const double kept = kept_over(period_s, rig.noise_time_s);
  SensorNoise cart_noise(rig.cart_noise_m, rig.noise_colour * rig.cart_noise_m, kept,
                         plan.seed * 32452843 + 5);
  SensorNoise theta_noise(rig.theta_noise_rad, rig.noise_colour * rig.theta_noise_rad, kept,
                          plan.seed * 49979687 + 7);
  double shown_m = 0.0;
  for (std::size_t k = 0; static_cast<double>(k) * period_s < plan.duration_s; ++k) {
    const double nominal_s = static_cast<double>(k) * period_s;
    // A loop wakes late, never early.
    const double late_s = std::min(std::abs(normal(random)) * rig.jitter_s * 1.66, 0.4 * period_s);
    const double read_s = nominal_s + late_s;
    simulator.advance_to(read_s);
    const Outputs<double> y = simulator.engine().outputs();
    double cart = y.cart_m;
    if (rig.unknown == Unknown::encoder_play)
      cart = shown_m = std::clamp(shown_m, cart - 0.5 * rig.play_m, cart + 0.5 * rig.play_m);
    const double cart_m = quantised(cart + cart_noise.next(), rig.cart_step_m);
    const double theta_rad = quantised(y.theta_rad + theta_noise.next(), rig.theta_step_rad);
    const double volts = driver.volts(k, nominal_s, cart_m, theta_rad);
    simulator.command(read_s, volts);
    if (in_gap(plan, nominal_s)) continue;
    run.time_s.push_back(rig.actual_times ? read_s : nominal_s);
    run.voltage_v.push_back(volts);
    if (!locked) run.cart_m.push_back(cart_m);
    if (pendulum) run.theta_rad.push_back(theta_rad);
  }
  return run;
}

}  // namespace upright::blind
