// Least squares of up to five coefficients, each between bounds.
#pragma once

#include <algorithm>
#include <array>

namespace upright {

/// Least squares with bounded coefficients.
class BoundedFit {
 public:
  static constexpr int max_coefficients = 5;
  using Row = std::array<double, max_coefficients>;

  void add(const Row& row, double target) {
    for (int i = 0; i < max_coefficients; ++i) {
      for (int j = 0; j < max_coefficients; ++j) h_[i][j] += row[i] * row[j];
      g_[i] += row[i] * target;
    }
    squares_ += target * target;
  }

  /// The share of the target's sum of squares that the fit accounts for.
  double accounted(const Row& low, const Row& high) const {
    if (!(squares_ > 0.0)) return 0.0;
    Row p{};
    for (int i = 0; i < max_coefficients; ++i) p[i] = std::clamp(0.0, low[i], high[i]);
    constexpr int rounds = 300;
    for (int round = 0; round < rounds; ++round)
      for (int i = 0; i < max_coefficients; ++i) {
        if (!(h_[i][i] > 0.0)) continue;
        double left = g_[i];
        for (int j = 0; j < max_coefficients; ++j)
          if (j != i) left -= h_[i][j] * p[j];
        p[i] = std::clamp(left / h_[i][i], low[i], high[i]);
      }
    double gained = 0.0;
    for (int i = 0; i < max_coefficients; ++i) {
      gained += 2.0 * p[i] * g_[i];
      for (int j = 0; j < max_coefficients; ++j) gained -= p[i] * h_[i][j] * p[j];
    }
    return gained / squares_;
  }
  double squares() const { return squares_; }

 private:
  double h_[max_coefficients][max_coefficients] = {}, g_[max_coefficients] = {}, squares_ = 0.0;
};

}  // namespace upright
