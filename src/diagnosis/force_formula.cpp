#include "force_formula.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <bit>
#include <cmath>
#include <sstream>
#include <vector>

namespace upright {

namespace {

constexpr std::size_t term_count = 4;
/// More terms are no short formula: the curve says as much.
constexpr int max_terms = 3;

double term(std::size_t number, double q) {
  const std::array<double, term_count> values = {1.0, q, q * std::abs(q), q * q * q};
  return values[number];
}

std::string name_of_term(std::size_t number, const std::string& symbol) {
  const std::array<std::string, term_count> names = {"", " " + symbol, " " + symbol + "|" + symbol + "|",
                                                     " " + symbol + "^3"};
  return names[number];
}

/// Terms with their coefficients by weighted least squares, and what they miss.
struct FittedTerms {
  std::vector<std::size_t> terms;
  Eigen::VectorXd coefficients;
  double chi_square = 0.0;
};

FittedTerms fit_terms(unsigned subset, const CurveNodes& nodes, const Eigen::VectorXd& force_n,
                      const Eigen::LDLT<Eigen::MatrixXd>& covariance) {
  FittedTerms fitted;
  for (std::size_t t = 0; t < term_count; ++t)
    if ((subset >> t & 1U) != 0) fitted.terms.push_back(t);
  Eigen::MatrixXd design(force_n.size(), static_cast<Eigen::Index>(fitted.terms.size()));
  for (Eigen::Index i = 0; i < design.rows(); ++i)
    for (Eigen::Index j = 0; j < design.cols(); ++j)
      design(i, j) = term(fitted.terms[static_cast<std::size_t>(j)],
                          nodes.first + nodes.spacing * static_cast<double>(i));
  const Eigen::MatrixXd weighted = covariance.solve(design);
  fitted.coefficients = (design.transpose() * weighted).ldlt().solve(weighted.transpose() * force_n);
  const Eigen::VectorXd missed = force_n - design * fitted.coefficients;
  fitted.chi_square = missed.dot(covariance.solve(missed));
  return fitted;
}

std::string text_of(const FittedTerms& fitted, const std::string& symbol, const std::string& unit) {
  std::ostringstream text;
  text.precision(3);
  for (std::size_t j = 0; j < fitted.terms.size(); ++j) {
    const double c = fitted.coefficients[static_cast<Eigen::Index>(j)];
    if (j == 0)
      text << c;
    else
      text << (c < 0.0 ? " - " : " + ") << std::abs(c);
    text << name_of_term(fitted.terms[j], symbol);
  }
  text << " [N, " << unit << "]";
  return text.str();
}

}  // namespace

std::optional<std::string> formula_of(const CurveNodes& nodes, const Eigen::VectorXd& force_n,
                                      const Eigen::MatrixXd& covariance, const std::string& symbol,
                                      const std::string& unit) {
  const Eigen::LDLT<Eigen::MatrixXd> factor(covariance);
  if (!factor.isPositive() || !(factor.vectorD().minCoeff() > 0.0)) return std::nullopt;
  for (int terms = 1; terms <= max_terms; ++terms) {
    std::optional<FittedTerms> best;
    for (unsigned subset = 1; subset < 1U << term_count; ++subset) {
      if (std::popcount(subset) != terms) continue;
      FittedTerms fitted = fit_terms(subset, nodes, force_n, factor);
      if (!best || fitted.chi_square < best->chi_square) best = std::move(fitted);
    }
    const double freedom = static_cast<double>(force_n.size()) - terms;
    if (best && best->chi_square <= freedom + 2.0 * std::sqrt(2.0 * freedom))
      return text_of(*best, symbol, unit);
  }
  return std::nullopt;
}

}  // namespace upright
