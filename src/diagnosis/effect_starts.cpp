#include "effect_starts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimation/smoother.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

namespace {

/// The force that the model lacks where the cart moves. A delay or a lag of the motor's force is left out.
std::vector<PlaceForce> force_residual(const FitData& data, const FitPoint& point,
                                       const SelectionPolicy& policy, std::size_t max_samples) {
  const Dynamics<double> dynamics(make_model<double>(point.plant));
  const double mass_kg = dynamics.base().cart_mass_kg;
  std::vector<PlaceForce> residual;
  for (const ResidualTrace& trace : smooth_residuals(data, point, policy.location.walk))
    for (std::size_t k = 0; k < trace.time_s.size(); ++k) {
      if (!(std::abs(trace.cart_mps[k]) > policy.location.moving_cart_mps)) continue;
      PlantState<double> state{};
      state.cart_m = trace.cart_m[k];
      state.cart_mps = trace.cart_mps[k];
      const double ripple_n = dynamics.motor_force(state, dynamics.actuate(trace.voltage_v[k])) -
                              dynamics.base().back_emf_n_per_mps * state.cart_mps;
      residual.push_back(
          {state.cart_m, trace.force_n[k], ripple_n, mass_kg * state.cart_mps * state.cart_mps});
    }
  if (residual.size() > max_samples) {
    std::vector<PlaceForce> thinned;
    for (std::size_t i = 0; i < max_samples; ++i)
      thinned.push_back(residual[i * residual.size() / max_samples]);
    residual = thinned;
  }
  return residual;
}

bool is_same_noise(const Noise& a, const Noise& b) {
  const auto numbers = [](const Noise& n) {
    return std::array{n.force,         n.torque,  n.coloured_force_n, n.coloured_torque_nm,
                      n.correlation_s, n.sensors, n.jitter_s};
  };
  return numbers(a) == numbers(b);
}

bool is_same(const FitPoint& a, const FitPoint& b) {
  const auto same_effect = [](const PlantEffect& one, const PlantEffect& other) {
    return one.number == other.number && one.values == other.values;
  };
  const auto numbers = [](const PlantState<double>& s) {
    return std::array{s.cart_m,    s.theta_rad,  s.cart_mps,    s.theta_radps,
                      s.bristle_m, s.attached_m, s.attached_mps};
  };
  const auto same_state = [&](const PlantState<double>& one, const PlantState<double>& other) {
    return numbers(one) == numbers(other);
  };
  return is_same_noise(a.noise, b.noise) &&
         std::ranges::equal(a.plant.effects, b.plant.effects, same_effect) &&
         std::ranges::equal(a.starts, b.starts, same_state);
}

}  // namespace

std::vector<std::vector<double>> EffectStarts::of(std::size_t effect, const DataRange& range,
                                                  const FitData& data, const FitPoint& point) {
  if (!is_periodic(effect)) return search_starts(effect, range, policy_.prior, budget_);
  if (!point_ || !is_same(*point_, point)) {
    residual_ = force_residual(data, point, policy_, budget_.max_residual_samples);
    periodic_.clear();
    point_ = point;
  }
  const auto [at, is_new] = periodic_.try_emplace(effect);
  if (is_new) at->second = periodic_starts(effect, residual_, range, policy_.prior, budget_);
  return at->second;
}

}  // namespace upright
