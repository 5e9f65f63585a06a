// The digits of fitted numbers that the data determine.
#pragma once

#include <vector>

#include "fit.hpp"

namespace upright {

/// The decimal number nearest to `value` whose last digit counts at most a hundredth of `standard_error`.
/// `value` itself where the standard error is not a positive number.
double rounded_to_significant_digits(double value, double standard_error);

/// Rounds the free parameters of a fit so, within their bounds. Processors round the intermediate results of
/// a fit differently, and the last digits of a model depend on it: a model of significant digits is the same
/// on all of them. The standard error is that of a parameter while all others are fixed, so that no
/// combination of parameters moves noticeably. The objective stays that of the fit.
void round_to_significant_digits(FitResult& fitted, const std::vector<FreeParameter>& free);

}  // namespace upright
