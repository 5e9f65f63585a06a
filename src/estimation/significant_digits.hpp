// The digits of fitted numbers that the data determine.
#pragma once

#include <vector>

#include "fit.hpp"

namespace upright {

/// `value`, rounded to a power of ten that is at most a hundredth of `standard_error`. Not rounded where the
/// standard error is not a positive number.
double rounded_to_significant_digits(double value, double standard_error);

/// Rounds the free parameters of a fit within their bounds. Processors differ in the last bits of a fit; the
/// rounded model is the same on all of them. The standard error of a parameter is the one while all others
/// are fixed, so that no combination of parameters moves noticeably. The objective stays that of the fit.
void round_to_significant_digits(FitResult& fitted, const std::vector<FreeParameter>& free);

}  // namespace upright
