// Dual numbers against those of Ceres, an independent implementation.
#include "upright/model/dual_number.hpp"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace upright {
namespace {

/// Every operation, with both kinds of operands, on three variables.
template <class S>
S expression(const S& x, const S& y, const S& z, double c) {
  S sum = x * y - z / y + c * x - x / c + (c - y) * (z + c) - (-x) * (y - c);
  sum += z * z;
  sum -= c / z;
  sum *= y;
  sum /= x + S(c);
  S other = x;
  other += c;
  other -= 2.0 * c;
  other *= c;
  other /= 3.0;
  using std::sqrt;
  return sum + (c + x) * other + sqrt(y * z);
}

template <int N>
void expect_same_as_ceres() {
  std::mt19937_64 random(N);
  std::uniform_real_distribution<double> any(0.5, 2.0);
  using Jet = ceres::Jet<double, N>;
  for (int trial = 0; trial < 200; ++trial) {
    DualNumber<N> of[3];
    Jet theirs[3];
    for (int k = 0; k < 3; ++k) {
      of[k] = DualNumber<N>(any(random));
      theirs[k] = Jet(of[k].a);
      for (int i = 0; i < N; ++i) of[k].v.set(i, theirs[k].v[i] = any(random) - 1.0);
    }
    const double c = any(random);
    const DualNumber<N> result = expression(of[0], of[1], of[2], c);
    const Jet expected = expression(theirs[0], theirs[1], theirs[2], c);
    EXPECT_NEAR(result.a, expected.a, 1e-13 * (1.0 + std::abs(expected.a)));
    for (int i = 0; i < N; ++i)
      EXPECT_NEAR(result.v[i], expected.v[i], 1e-12 * (1.0 + std::abs(expected.v[i])));
  }
}

TEST(DualNumber, IsThatOfCeres) {
  expect_same_as_ceres<1>();
  expect_same_as_ceres<4>();
  expect_same_as_ceres<6>();
  expect_same_as_ceres<16>();
}

TEST(DualNumber, ComparesByItsValue) {
  using Dual = DualNumber<2>;
  const Dual one(1.0, 0), two(2.0, 1);
  EXPECT_TRUE(one < two && one <= two && two > one && two >= one);
  EXPECT_FALSE(two < one || two <= one || one > two || one >= two);
  EXPECT_TRUE(one == Dual(1.0));
}

TEST(DualNumber, VariablesHaveUnitDerivatives) {
  const DualNumber<6> x(3.0, 5), constant(2.0);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(x.v[i], i == 5 ? 1.0 : 0.0);
    EXPECT_EQ(constant.v[i], 0.0);
  }
}

TEST(Derivatives, AddsFromAPlaceOn) {
  Derivatives<6> sum, row;
  for (int i = 0; i < 6; ++i) row.set(i, i + 1.0);
  sum.add_from(4, 2.0, row);
  EXPECT_EQ(sum[4], 10.0);
  EXPECT_EQ(sum[5], 12.0);
  row.clear_first(3);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(row[i], i < 3 ? 0.0 : i + 1.0);
}

}  // namespace
}  // namespace upright
