// A short formula for a force that was drawn as a curve, where one fits the curve within its uncertainty.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "estimation/force_curve.hpp"

namespace upright {

/// Terms of a formula in a quantity q.
enum class Term { one, linear, square, cube };  ///< 1, q, q|q|, q^3
inline constexpr std::array<Term, 4> all_terms = {Term::one, Term::linear, Term::square, Term::cube};

/// A sum of terms.
struct ForceFormula {
  std::vector<Term> terms;
  Eigen::VectorXd coefficients;  ///< one per term
  double chi_square = 0.0;       ///< what it misses of the curve, in units of the curve's uncertainty

  /// As "0.31 - 2.2 v|v| [N, m/s]". `symbol`: of the quantity, `unit`: of the quantity.
  std::string text(const std::string& symbol, const std::string& unit) const;
};

/// The sum of the fewest terms, three at most, that fits the curve: its misfit is within two standard
/// deviations of what chance gives. `force_n`: at the nodes, `covariance`: of these values. Empty if none
/// fits.
std::optional<ForceFormula> formula_of(const CurveNodes& nodes, const Eigen::VectorXd& force_n,
                                       const Eigen::MatrixXd& covariance);

}  // namespace upright
