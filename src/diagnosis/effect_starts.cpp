#include "effect_starts.hpp"

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

}  // namespace

std::vector<std::vector<double>> effect_starts(std::size_t effect, const DataRange& range,
                                               const FitData& data, const FitPoint& point,
                                               const SelectionPolicy& policy, const SearchBudget& budget) {
  const bool periodic = effect_registry()[effect].kind == "cogging_force";
  return search_starts(effect, range,
                       periodic ? force_residual(data, point, policy, budget.max_residual_samples)
                                : std::vector<std::pair<double, double>>{},
                       policy.prior, budget);
}

}  // namespace upright
