// Draws from a seeded generator.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <random>

namespace upright::blind {

using Random = std::mt19937_64;

inline double between(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Every factor is as likely: for numbers that are known to an order of magnitude.
inline double between_by_ratio(Random& random, double low, double high) {
  return low * std::pow(high / low, between(random, 0.0, 1.0));
}

inline bool chance(Random& random, double p) {
  return std::bernoulli_distribution(p)(random);
}

inline double either_sign(Random& random) {
  return chance(random, 0.5) ? 1.0 : -1.0;
}

template <std::size_t N>
double one_of(Random& random, const std::array<double, N>& values) {
  return values[std::uniform_int_distribution<std::size_t>(0, N - 1)(random)];
}

}  // namespace upright::blind
