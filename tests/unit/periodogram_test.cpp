// The periodogram against what is known: a sine that is there, and a least-squares fit by another library.
#include "estimation/periodogram.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace upright {
namespace {

/// At random places, of an effect whose force also depends on something else.
std::vector<PeriodogramSample> random_forces(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-0.4, 0.6), unit(-1.5, 1.5);
  std::normal_distribution<double> force;
  std::vector<PeriodogramSample> forces(count);
  for (PeriodogramSample& at : forces) at = {place(random), force(random), unit(random)};
  return forces;
}

double angle_rad(double frequency_per_m, double place_m) {
  return 2.0 * std::numbers::pi * frequency_per_m * place_m;
}

TEST(Periodogram, FindsTheSineThatIsThere) {
  constexpr double size = 0.3, frequency_per_m = 23.5, phase_rad = 0.7;
  std::vector<PeriodogramSample> forces = random_forces(101, 1);
  for (PeriodogramSample& at : forces)
    at.force_n = at.unit_n * (size * std::sin(angle_rad(frequency_per_m, at.place_m) + phase_rad) - 0.2);
  const std::vector<FittedSine> found = periodogram(forces, 5.0, 60.0, 0.25);
  const FittedSine best = *std::ranges::max_element(found, {}, &FittedSine::explained);
  EXPECT_NEAR(best.frequency_per_m, frequency_per_m, 1e-9);
  EXPECT_NEAR(best.size, size, 1e-9);
  EXPECT_NEAR(best.phase_rad, phase_rad, 1e-9);
}

// For numbers of forces that fill a SIMD register, and others.
TEST(Periodogram, ExplainsWhatALeastSquaresFitExplains) {
  for (const std::size_t count : {16u, 17u, 60u, 127u}) {
    const std::vector<PeriodogramSample> forces = random_forces(count, count);
    const auto n = static_cast<Eigen::Index>(count);
    Eigen::MatrixXd columns(n, 3);
    Eigen::VectorXd force_n(n);
    for (const FittedSine& sine : periodogram(forces, 2.0, 12.0, 0.5)) {
      for (Eigen::Index i = 0; i < n; ++i) {
        const PeriodogramSample& at = forces[static_cast<std::size_t>(i)];
        const double angle = angle_rad(sine.frequency_per_m, at.place_m);
        columns.row(i) << at.unit_n, at.unit_n * std::sin(angle), at.unit_n * std::cos(angle);
        force_n[i] = at.force_n;
      }
      const auto left = [&](Eigen::Index used) {
        const Eigen::MatrixXd some = columns.leftCols(used);
        return (force_n - some * some.colPivHouseholderQr().solve(force_n)).squaredNorm();
      };
      const Eigen::VectorXd factors = columns.colPivHouseholderQr().solve(force_n);
      EXPECT_NEAR(sine.explained, left(1) - left(3), 1e-9);
      EXPECT_NEAR(sine.size, std::hypot(factors[1], factors[2]), 1e-9);
      EXPECT_NEAR(std::remainder(sine.phase_rad - std::atan2(factors[2], factors[1]), 2.0 * std::numbers::pi),
                  0.0, 1e-9);
    }
  }
}

// Of places that repeat with the pitch, the sine is the same everywhere.
TEST(Periodogram, LeavesOutWhatThePlacesDoNotShow) {
  std::vector<PeriodogramSample> forces;
  for (int i = 0; i < 20; ++i) forces.push_back({0.1 * (i % 5), std::sin(1.0 * i), 1.0});
  const std::vector<FittedSine> found = periodogram(forces, 5.0, 10.0, 5.0);
  EXPECT_TRUE(std::ranges::none_of(found, [](const FittedSine& s) { return s.frequency_per_m == 10.0; }));
}

}  // namespace
}  // namespace upright
