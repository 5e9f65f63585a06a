// The response through the Schur form against a solution of the whole equations.
#include "design/frequency_response.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "model/dense_algebra.hpp"

namespace upright {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd random_matrix(Index rows, Index columns, std::mt19937& random) {
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

TEST(FrequencyResponse, EqualsTheSolutionOfTheEquations) {
  std::mt19937 random(7);
  for (const Index states : {1, 2, 3, 8, 25})
    for (const Index inputs : {1, 3}) {
      const MatrixXd a = random_matrix(states, states, random), b = random_matrix(states, inputs, random);
      const Eigen::RowVectorXd c = random_matrix(1, states, random);
      const FrequencyResponse response(a, b, c);
      for (const double angle : {0.0, 1e-3, 0.7, 2.0, std::numbers::pi}) {
        const Complex z = std::polar(1.0, angle);
        Eigen::MatrixXcd m = -a.cast<Complex>();
        m.diagonal().array() += z;
        const Eigen::RowVectorXcd got = response.at(z);
        ASSERT_EQ(got.size(), inputs);
        for (Index j = 0; j < inputs; ++j) {
          const Complex expected = (c.cast<Complex>() * solve(m, b.col(j).cast<Complex>()))(0);
          EXPECT_LT(std::abs(got(j) - expected), 1e-11 * (1.0 + std::abs(expected)))
              << states << " states, angle " << angle;
        }
      }
    }
}

// x1' = x2, x2' = u: 1 / s^2. The first pivot s vanishes against the subdiagonal entry near s = 0.
TEST(FrequencyResponse, OfADoubleIntegratorIsOneOverSSquared) {
  const MatrixXd a = (MatrixXd(2, 2) << 0.0, 1.0, 0.0, 0.0).finished();
  const FrequencyResponse response(a, MatrixXd(Eigen::Vector2d(0.0, 1.0)), Eigen::RowVector2d(1.0, 0.0));
  for (const double w : {1e-6, 1e-2, 1.0, 1e3}) {
    const Complex got = response.at(Complex(0.0, w))(0);
    EXPECT_NEAR(got.real() * w * w, -1.0, 1e-12);
    EXPECT_NEAR(got.imag() * w * w, 0.0, 1e-12);
  }
}

}  // namespace
}  // namespace upright
