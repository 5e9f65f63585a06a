// An order of runs that does not depend on the order in which they were read. Then the choice of segments and
// the rounding of sums do not depend on it either.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <tuple>
#include <vector>

#include "upright/measurement/measurement.hpp"

namespace upright {

/// Indices of the runs, sorted by their contents.
inline std::vector<std::size_t> canonical_order(const std::vector<Measurement>& runs) {
  std::vector<std::size_t> order(runs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const auto key = [&](std::size_t i) {
      const Measurement& run = runs[i];
      return std::tie(run.cart_locked, run.voltage_v, run.cart_m, run.theta_rad, run.time_s);
    };
    return key(a) < key(b);
  });
  return order;
}

inline std::vector<Measurement> arranged(const std::vector<Measurement>& runs,
                                         const std::vector<std::size_t>& order) {
  std::vector<Measurement> sorted;
  sorted.reserve(order.size());
  for (const std::size_t i : order) sorted.push_back(runs[i]);
  return sorted;
}

/// Results of the arranged runs, in the order in which the runs were given.
template <class Reading>
std::vector<Reading> in_given_order(std::vector<Reading> readings, const std::vector<std::size_t>& order) {
  for (Reading& reading : readings) reading.run = order[reading.run];
  std::stable_sort(readings.begin(), readings.end(),
                   [](const Reading& a, const Reading& b) { return a.run < b.run; });
  return readings;
}

}  // namespace upright
