#include "extra_forces.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace upright::blind {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

void add_constant_force(Plant& plant, double force_n) {
  constexpr std::string_view kind = "constant_force";
  const PlantEffect* have = plant.find(kind);
  plant.set(kind, {force_n + (have != nullptr ? have->values[0] : 0.0)});
}

/// What a torque at the pivot does to the velocities within a step. A pendulum that dry friction holds stays
/// at rest.
void push_pendulum(const CvodeEngine& engine, double torque_nm, PlantState<double>& state) {
  const Dynamics<double>& dynamics = engine.dynamics();
  if (dynamics.pivot_can_stick() && engine.contacts().pivot == Contact::stick) return;
  const double impulse = torque_nm * force_step_s;
  const auto& base = dynamics.base();
  const double inertia = base.inertia_about_pivot_kgm2;
  if (dynamics.cart_locked() || engine.cart_at_rest()) {
    state.theta_radps += impulse / inertia;
    return;
  }
  const double total_kg = base.cart_mass_kg + base.pendulum_mass_kg;
  const double coupling = base.pendulum_mass_kg * base.length_to_com_m * std::cos(state.theta_rad);
  const double determinant = total_kg * inertia - coupling * coupling;
  state.theta_radps += total_kg * impulse / determinant;
  state.cart_mps -= coupling * impulse / determinant;
}

}  // namespace

ExtraForces::ExtraForces(const Rig& rig, const Plan& plan)
    : rig_(rig),
      duration_s_(plan.duration_s),
      rough_(rig.rough_length_m, rig.track_seed),
      unknown_rough_(rig.unknown_period, rig.track_seed + 1) {
  const auto steps = static_cast<std::size_t>(plan.duration_s / force_step_s) + 16;
  force_.assign(steps, 0.0);
  coloured_.assign(steps, 0.0);
  torque_.assign(steps, 0.0);
  std::mt19937_64 random(plan.seed * 7919 + 1);
  add_white_bandwidth(random);
  if (rig.unknown == Unknown::gusts) add_gusts(random);
  add_coloured(plan.seed * 15485863 + 11);
  varies_ = rig.disturbance_n > 0.0 || rig.coloured.force_n > 0.0 || rig.coloured.torque_nm > 0.0 ||
            rig.rough_n > 0.0 || (rig.unknown != Unknown::none && rig.unknown != Unknown::encoder_play);
}

std::size_t ExtraForces::index_at(double time_s) const {
  return std::min(static_cast<std::size_t>(std::max(time_s, 0.0) / force_step_s + 0.5), force_.size() - 1);
}

double ExtraForces::cart_force_n(double time_s, const PlantState<double>& state) const {
  const std::size_t k = index_at(time_s);
  double force = force_[k];
  if (coloured_[k] != 0.0) {
    const double speed = rig_.coloured.speed_mps;
    const double growth = speed > 0.0 ? std::hypot(1.0, state.cart_mps / speed) : 1.0;
    force += growth * coloured_[k];
  }
  if (rig_.rough_n > 0.0) force += rig_.rough_n * rough_.at(state.cart_m);
  const double size = rig_.unknown_size, period = rig_.unknown_period;
  switch (rig_.unknown) {
    case Unknown::rough_track:
      return force + size * unknown_rough_.at(state.cart_m);
    case Unknown::velocity_ripple:
      return force + size * std::sin(two_pi * state.cart_mps / period);
    case Unknown::force_drift:
      return force + size * (2.0 * time_s / duration_s_ - 1.0);
    case Unknown::none:
    case Unknown::encoder_play:
    case Unknown::gusts:
      break;
  }
  return force;
}

double ExtraForces::pivot_torque_nm(double time_s) const {
  return torque_[index_at(time_s)];
}

Plant ExtraForces::plant_at(double time_s, const PlantState<double>& state) const {
  Plant plant = rig_.plant;
  const double force = cart_force_n(time_s, state);
  if (force != 0.0) add_constant_force(plant, force);
  return plant;
}

void ExtraForces::add_white_bandwidth(std::mt19937_64& random) {
  constexpr double bandwidth_radps = two_pi * 10.0;
  GaussMarkov process(rig_.disturbance_n, std::exp(-bandwidth_radps * force_step_s), random);
  for (double& f : force_) {
    f = process.value();
    process.step(random);
  }
}

/// From a seed of its own: the other conditions keep their draws.
void ExtraForces::add_coloured(std::uint64_t seed) {
  const ColouredDisturbance& coloured = rig_.coloured;
  std::mt19937_64 random(seed);
  const auto fill = [&](std::vector<double>& values, double deviation, double correlation_time_s) {
    if (deviation <= 0.0) return;
    GaussMarkov process(deviation, kept_over(force_step_s, correlation_time_s), random);
    for (double& value : values) {
      value = process.value();
      process.step(random);
    }
  };
  fill(coloured_, coloured.force_n, coloured.force_time_s);
  fill(torque_, coloured.torque_nm, coloured.torque_time_s);
}

/// About one every two seconds, 0.1 to 0.4 s long, either way.
void ExtraForces::add_gusts(std::mt19937_64& random) {
  std::exponential_distribution<double> wait(0.5);
  std::uniform_real_distribution<double> length(0.1, 0.4), size(0.5, 1.5);
  std::bernoulli_distribution forward(0.5);
  for (double t = wait(random); t < force_step_s * static_cast<double>(force_.size()); t += wait(random)) {
    const double duration = length(random);
    const double peak = (forward(random) ? 1.0 : -1.0) * size(random) * rig_.gust_force_n;
    for (double u = 0.0; u < duration; u += force_step_s) {
      const auto k = static_cast<std::size_t>((t + u) / force_step_s);
      if (k < force_.size()) force_[k] += peak * std::pow(std::sin(std::numbers::pi * u / duration), 2);
    }
  }
}

void VaryingEngine::advance(double duration_s, double volts) {
  if (extra_ == nullptr) return engine_.advance(duration_s, volts);
  const double end_s = engine_.time_s() + duration_s;
  while (end_s - engine_.time_s() > 1e-12) {
    const double now_s = engine_.time_s();
    const double cell = std::floor(now_s / force_step_s + 1e-6);
    if (cell != cell_) {
      cell_ = cell;
      PlantState<double> state = engine_.state();
      const double torque_nm = extra_->pivot_torque_nm(now_s);
      if (torque_nm != 0.0) push_pendulum(engine_, torque_nm, state);
      const Plant plant = extra_->plant_at(now_s, state);
      engine_ = CvodeEngine(make_model<double>(plant, locked_), options_);
      engine_.start(state, now_s, volts);
    }
    engine_.advance(std::min(end_s, (cell + 1.0) * force_step_s) - now_s, volts);
  }
}

}  // namespace upright::blind
