// A formula in place of a curve: found where one fits within the curve's uncertainty, and only there.
#include "diagnosis/force_formula.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace upright {
namespace {

constexpr Eigen::Index count = 13;
const CurveNodes nodes{-0.6, 0.1, count};

template <class F>
Eigen::VectorXd sampled(const F& f) {
  Eigen::VectorXd values(count);
  for (Eigen::Index i = 0; i < count; ++i)
    values[i] = f(nodes.first + nodes.spacing * static_cast<double>(i));
  return values;
}

Eigen::MatrixXd uncertainty(double sigma_n) {
  return Eigen::MatrixXd::Identity(count, count) * sigma_n * sigma_n;
}

TEST(ForceFormula, TakesTheFewestTermsThatFit) {
  const auto line = sampled([](double v) { return -2.0 * v; });
  const auto of_line = formula_of(nodes, line, uncertainty(0.01));
  ASSERT_TRUE(of_line);
  EXPECT_EQ(of_line->terms, std::vector<Term>{Term::linear});
  EXPECT_EQ(of_line->text("v", "m/s"), "-2 v [N, m/s]");
  const auto drag = sampled([](double v) { return 0.25 - 3.0 * v * std::abs(v); });
  const auto of_drag = formula_of(nodes, drag, uncertainty(0.001));
  ASSERT_TRUE(of_drag);
  EXPECT_EQ(of_drag->text("v", "m/s"), "0.25 - 3 v|v| [N, m/s]");
}

TEST(ForceFormula, OfACurveThatNoTermHasIsNone) {
  const auto ripple = sampled([](double v) { return 0.2 * std::sin(20.0 * v); });
  EXPECT_FALSE(formula_of(nodes, ripple, uncertainty(0.01)));
  EXPECT_TRUE(formula_of(nodes, ripple, uncertainty(1.0))) << "a coarse curve is nearly anything";
}

TEST(ForceFormula, NeedsAnUncertainty) {
  EXPECT_FALSE(formula_of(nodes, sampled([](double v) { return v; }), uncertainty(0.0)));
}

}  // namespace
}  // namespace upright
