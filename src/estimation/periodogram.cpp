#include "periodogram.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>

#include "sim/loop/lanes.hpp"

namespace upright {

namespace {

double sum_of(const Lanes& lanes) {
  const std::array<double, lane_count> numbers = lanes.values();
  return std::accumulate(numbers.begin(), numbers.end(), 0.0);
}

/// Several forces, with sine and cosine of 2 pi f x for a rising frequency: turned by the same angle each
/// time, since the functions themselves took longer than all else. Places beyond the last have no force.
struct Wave {
  Lanes force_n, unit_n, sine, cosine, turn_sine, turn_cosine;

  void set(std::size_t lane, const PeriodogramSample& at, double lowest_per_m, double spacing_per_m) {
    const double first_rad = 2.0 * std::numbers::pi * lowest_per_m * at.place_m;
    const double turn_rad = 2.0 * std::numbers::pi * spacing_per_m * at.place_m;
    put(force_n, lane, at.force_n);
    put(unit_n, lane, at.unit_n);
    put(sine, lane, std::sin(first_rad));
    put(cosine, lane, std::cos(first_rad));
    put(turn_sine, lane, std::sin(turn_rad));
    put(turn_cosine, lane, std::cos(turn_rad));
  }

  void advance() {
    const Lanes former = sine;
    sine = sine * turn_cosine + cosine * turn_sine;
    cosine = cosine * turn_cosine - former * turn_sine;
  }
};

}  // namespace

std::vector<FittedSine> periodogram(const std::vector<PeriodogramSample>& forces, double lowest_per_m,
                                    double highest_per_m, double spacing_per_m) {
  std::vector<Wave> waves((forces.size() + lane_count - 1) / lane_count);
  for (std::size_t i = 0; i < forces.size(); ++i)
    waves[i / lane_count].set(i % lane_count, forces[i], lowest_per_m, spacing_per_m);
  double unit_force = 0.0, power = 0.0;
  for (const PeriodogramSample& at : forces) {
    unit_force += at.unit_n * at.force_n;
    power += at.unit_n * at.unit_n;
  }
  std::vector<FittedSine> found;
  for (double f = lowest_per_m; f <= highest_per_m; f += spacing_per_m) {
    Lanes ss_l, sc_l, cc_l, sy_l, cy_l, s1_l, c1_l;
    for (Wave& wave : waves) {
      const Lanes s = wave.unit_n * wave.sine, c = wave.unit_n * wave.cosine;
      wave.advance();
      ss_l += s * s;
      sc_l += s * c;
      cc_l += c * c;
      sy_l += s * wave.force_n;
      cy_l += c * wave.force_n;
      s1_l += wave.unit_n * s;
      c1_l += wave.unit_n * c;
    }
    const double s1 = sum_of(s1_l), c1 = sum_of(c1_l);
    const double ss = sum_of(ss_l) - s1 * s1 / power, sc = sum_of(sc_l) - s1 * c1 / power,
                 cc = sum_of(cc_l) - c1 * c1 / power, sy = sum_of(sy_l) - s1 * unit_force / power,
                 cy = sum_of(cy_l) - c1 * unit_force / power;
    const double determinant = ss * cc - sc * sc;
    constexpr double indistinct = 1e-8;  // [of the squared power]
    if (!(determinant > indistinct * power * power)) continue;
    const double a = (cc * sy - sc * cy) / determinant, b = (ss * cy - sc * sy) / determinant;
    found.push_back({a * sy + b * cy, std::hypot(a, b), f, std::atan2(b, a)});
  }
  return found;
}

}  // namespace upright
