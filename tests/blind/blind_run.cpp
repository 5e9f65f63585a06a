#include "blind_run.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "upright/control/controller.hpp"
#include "upright/sim/cvode_engine.hpp"
#include "upright/sim/simulator.hpp"

namespace upright::blind {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double amplifier_limit_v = 10.0;
/// How often forces that vary with time are given a new value.
constexpr double force_step_s = 1e-3;

double quantised(double value, double step) {
  return step * std::round(value / step);
}

/// Forces on the cart that no plant file has, every `force_step_s`.
class Extra {
 public:
  Extra(const Rig& rig, const Plan& plan) : rig_(rig) {
    const auto steps = static_cast<std::size_t>(plan.duration_s / force_step_s) + 16;
    force_.assign(steps, 0.0);
    std::mt19937_64 random(plan.seed * 7919 + 1);
    add_disturbance(random);
    if (rig.unknown == Unknown::gusts) add_gusts(random);
  }

  bool varies() const { return rig_.disturbance_n > 0.0 || rig_.unknown == Unknown::gusts || warms(); }

  Plant plant_at(double time_s) const {
    Plant plant = rig_.plant;
    const auto k =
        std::min(static_cast<std::size_t>(std::max(time_s, 0.0) / force_step_s + 0.5), force_.size() - 1);
    if (force_[k] != 0.0) add(plant, "constant_force", force_[k]);
    if (warms())
      add(plant, "coulomb_friction", rig_.warming_force_n * std::exp(-time_s / rig_.warming_time_s));
    return plant;
  }

 private:
  bool warms() const { return rig_.unknown == Unknown::warming_friction; }

  static void add(Plant& plant, std::string_view kind, double force_n) {
    const PlantEffect* have = plant.find(kind);
    plant.set(kind, {force_n + (have != nullptr ? have->values[0] : 0.0)});
  }

  void add_disturbance(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    constexpr double bandwidth_radps = 2.0 * pi * 10.0;
    const double kept = std::exp(-bandwidth_radps * force_step_s);
    double force = rig_.disturbance_n * normal(random);
    for (double& f : force_) {
      f = force;
      force = kept * force + rig_.disturbance_n * std::sqrt(1.0 - kept * kept) * normal(random);
    }
  }

  /// About one every two seconds, 0.1 to 0.4 s long, either way.
  void add_gusts(std::mt19937_64& random) {
    std::exponential_distribution<double> wait(0.5);
    std::uniform_real_distribution<double> length(0.1, 0.4), size(0.5, 1.5);
    std::bernoulli_distribution forward(0.5);
    for (double t = wait(random); t < force_step_s * static_cast<double>(force_.size()); t += wait(random)) {
      const double duration = length(random);
      const double peak = (forward(random) ? 1.0 : -1.0) * size(random) * rig_.gust_force_n;
      for (double u = 0.0; u < duration; u += force_step_s) {
        const auto k = static_cast<std::size_t>((t + u) / force_step_s);
        if (k < force_.size()) force_[k] += peak * std::pow(std::sin(pi * u / duration), 2);
      }
    }
  }

  const Rig& rig_;
  std::vector<double> force_;
};

/// The reference engine on a plant that changes from millisecond to millisecond.
class VaryingEngine {
 public:
  VaryingEngine(const PlantModel<double>& model, const EngineOptions& options)
      : locked_(model.cart_locked), options_(options), engine_(model, options) {}

  void vary(const Extra* extra) { extra_ = extra; }

  void start(const PlantState<double>& state, double time_s, double volts) {
    engine_.start(state, time_s, volts);
  }

  void advance(double duration_s, double volts) {
    if (extra_ == nullptr) return engine_.advance(duration_s, volts);
    const double end_s = engine_.time_s() + duration_s;
    while (end_s - engine_.time_s() > 1e-12) {
      const double now_s = engine_.time_s();
      const double cell = std::floor(now_s / force_step_s + 1e-6);
      if (cell != cell_) {
        cell_ = cell;
        const PlantState<double> state = engine_.state();
        engine_ = CvodeEngine(make_model<double>(extra_->plant_at(now_s), locked_), options_);
        engine_.start(state, now_s, volts);
      }
      engine_.advance(std::min(end_s, (cell + 1.0) * force_step_s) - now_s, volts);
    }
  }

  const Dynamics<double>& dynamics() const { return engine_.dynamics(); }
  const PlantState<double>& state() const { return engine_.state(); }
  Outputs<double> outputs() const { return engine_.outputs(); }

 private:
  bool locked_;
  EngineOptions options_;
  CvodeEngine engine_;
  const Extra* extra_ = nullptr;
  double cell_ = -1.0;
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
    set_point_m_ = std::uniform_real_distribution<double>(0.03, 0.08)(random_);
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
    constexpr double track_m = 0.3;
    if (t >= until_s_ || (level_ != 0.0 && level_ * cart_m > 0.0 && std::abs(cart_m) > track_m)) {
      const bool pause = level_ != 0.0;
      if (!pause) direction_ = std::abs(cart_m) > 0.05 ? (cart_m > 0.0 ? -1.0 : 1.0) : -direction_;
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
    case Unknown::backlash:
      return "backlash";
    case Unknown::warming_friction:
      return "warming_friction";
    case Unknown::gusts:
      return "gusts";
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
  const Extra extra(rig, plan);
  EngineOptions options;
  options.relative_tolerance = 1e-9;
  BasicSimulator<VaryingEngine, double> simulator(make_model<double>(rig.plant, locked), options);
  if (extra.varies() && !locked) simulator.engine().vary(&extra);
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
  double shown_m = 0.0;
  for (std::size_t k = 0; static_cast<double>(k) * period_s < plan.duration_s; ++k) {
    const double nominal_s = static_cast<double>(k) * period_s;
    // A loop wakes late, never early.
    const double late_s = std::min(std::abs(normal(random)) * rig.jitter_s * 1.66, 0.4 * period_s);
    const double read_s = nominal_s + late_s;
    simulator.advance_to(read_s);
    const Outputs<double> y = simulator.engine().outputs();
    double cart = y.cart_m;
    if (rig.unknown == Unknown::backlash)
      cart = shown_m = std::clamp(shown_m, cart - 0.5 * rig.backlash_m, cart + 0.5 * rig.backlash_m);
    const double cart_m = quantised(cart, rig.cart_step_m);
    const double theta_rad = quantised(y.theta_rad, rig.theta_step_rad);
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
