#include "force_formula.hpp"

#include <bit>
#include <cmath>
#include <sstream>
#include <utility>

#include "model/dense_algebra.hpp"

namespace upright {

namespace {

/// More terms are no short formula: the curve says as much.
constexpr int max_terms = 3;

double value_of(Term term, double q) {
  switch (term) {
    case Term::one:
      return 1.0;
    case Term::linear:
      return q;
    case Term::square:
      return q * std::abs(q);
    case Term::cube:
      return q * q * q;
  }
  return 0.0;
}

std::string name_of(Term term, const std::string& symbol) {
  switch (term) {
    case Term::one:
      return "";
    case Term::linear:
      return " " + symbol;
    case Term::square:
      return " " + symbol + "|" + symbol + "|";
    case Term::cube:
      return " " + symbol + "^3";
  }
  return "";
}

/// Coefficients by weighted least squares.
ForceFormula fit_terms(std::vector<Term> terms, const CurveNodes& nodes, const Eigen::VectorXd& force_n,
                       const Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd design(force_n.size(), static_cast<Eigen::Index>(terms.size()));
  for (Eigen::Index i = 0; i < design.rows(); ++i)
    for (Eigen::Index j = 0; j < design.cols(); ++j)
      design(i, j) =
          value_of(terms[static_cast<std::size_t>(j)], nodes.first + nodes.spacing * static_cast<double>(i));
  const Eigen::MatrixXd weighted = solve_symmetric(covariance, design);
  ForceFormula formula{std::move(terms),
                       solve_symmetric(design.transpose() * weighted, weighted.transpose() * force_n)};
  const Eigen::VectorXd missed = force_n - design * formula.coefficients;
  formula.chi_square = missed.dot(Eigen::VectorXd(solve_symmetric(covariance, missed)));
  return formula;
}

/// The terms whose bits are set.
std::vector<Term> terms_of(unsigned subset) {
  std::vector<Term> terms;
  for (std::size_t t = 0; t < all_terms.size(); ++t)
    if ((subset >> t & 1U) != 0) terms.push_back(all_terms[t]);
  return terms;
}

}  // namespace

std::string ForceFormula::text(const std::string& symbol, const std::string& unit) const {
  std::ostringstream text;
  text.precision(3);
  for (std::size_t j = 0; j < terms.size(); ++j) {
    const double c = coefficients[static_cast<Eigen::Index>(j)];
    if (j == 0)
      text << c;
    else
      text << (c < 0.0 ? " - " : " + ") << std::abs(c);
    text << name_of(terms[j], symbol);
  }
  text << " [N, " << unit << "]";
  return text.str();
}

std::optional<ForceFormula> formula_of(const CurveNodes& nodes, const Eigen::VectorXd& force_n,
                                       const Eigen::MatrixXd& covariance) {
  if (!(symmetric_pivots(covariance).minCoeff() > 0.0)) return std::nullopt;
  for (int count = 1; count <= max_terms; ++count) {
    std::optional<ForceFormula> best;
    for (unsigned subset = 1; subset < 1U << all_terms.size(); ++subset) {
      if (std::popcount(subset) != count) continue;
      ForceFormula formula = fit_terms(terms_of(subset), nodes, force_n, covariance);
      if (!best || formula.chi_square < best->chi_square) best = std::move(formula);
    }
    const double freedom = static_cast<double>(force_n.size()) - count;
    if (best && best->chi_square <= freedom + 2.0 * std::sqrt(2.0 * freedom)) return best;
  }
  return std::nullopt;
}

}  // namespace upright
