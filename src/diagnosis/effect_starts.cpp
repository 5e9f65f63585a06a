#include "effect_starts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimation/smoother.hpp"

namespace upright {

namespace {

/// Positions of the moving cart and the force that the model lacks there, m and N.
std::vector<std::pair<double, double>> force_residual(const FitData& data, const FitPoint& point,
                                                      const SelectionPolicy& policy, std::size_t max_pairs) {
  std::vector<std::pair<double, double>> pairs;
  for (const ResidualTrace& trace : smooth_residuals(data, point, policy.location.walk))
    for (std::size_t k = 0; k < trace.time_s.size(); ++k)
      if (std::abs(trace.cart_mps[k]) > policy.location.moving_cart_mps)
        pairs.emplace_back(trace.cart_m[k], trace.force_n[k]);
  if (pairs.size() > max_pairs) {
    std::vector<std::pair<double, double>> thinned;
    for (std::size_t i = 0; i < max_pairs; ++i) thinned.push_back(pairs[i * pairs.size() / max_pairs]);
    pairs = thinned;
  }
  return pairs;
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
    return std::array{s.cart_m, s.theta_rad, s.cart_mps, s.theta_radps, s.bristle_m};
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
  if (effect_registry()[effect].kind != "cogging_force")
    return search_starts(effect, range, {}, policy_.prior, budget_);
  if (!point_ || !is_same(*point_, point)) {
    periodic_ =
        search_starts(effect, range, force_residual(data, point, policy_, budget_.max_residual_samples),
                      policy_.prior, budget_);
    point_ = point;
  }
  return periodic_;
}

}  // namespace upright
