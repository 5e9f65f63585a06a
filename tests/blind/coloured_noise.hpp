// Noise that remembers: over time, and over a place.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>

namespace upright::blind {

/// A Gauss-Markov process (Ornstein-Uhlenbeck) sampled at even steps: its values have one standard deviation,
/// and their correlation decays exponentially. It starts in its steady state.
class GaussMarkov {
 public:
  /// `kept`: the correlation of one value with the next.
  template <class Random>
  GaussMarkov(double deviation, double kept, Random& random)
      : kept_(kept), fresh_(deviation * std::sqrt(1.0 - kept * kept)), value_(deviation * normal_(random)) {}

  double value() const { return value_; }

  template <class Random>
  void step(Random& random) {
    value_ = kept_ * value_ + fresh_ * normal_(random);
  }

 private:
  std::normal_distribution<double> normal_;
  double kept_, fresh_, value_;
};

/// Correlation of a Gauss-Markov process over a step of time.
inline double kept_over(double step_s, double correlation_time_s) {
  return std::exp(-step_s / correlation_time_s);
}

/// A random function of a place that stays what it is: a sum of cosines with random wave numbers. Over all
/// functions, mean 0, variance 1 and correlation exp(-(distance / length)^2 / 2).
class RoughTrack {
 public:
  RoughTrack(double correlation_length_m, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> wave_number(0.0, 1.0 / correlation_length_m);
    std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
    for (auto& [k, p] : waves_) {
      k = wave_number(random);
      p = phase(random);
    }
  }

  double at(double place_m) const {
    double sum = 0.0;
    for (const auto& [k, p] : waves_) sum += std::cos(k * place_m + p);
    return sum * std::sqrt(2.0 / static_cast<double>(waves_.size()));
  }

 private:
  std::array<std::pair<double, double>, 48> waves_{};
};

}  // namespace upright::blind
