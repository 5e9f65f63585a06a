// Numbers for display: rounded, without an exponent where a plain number is as short.
#pragma once

#include <string>

namespace upright {

/// `digits` significant digits: 0.4306, 12350, 3.1 × 10⁻⁷. Plain notation from 0.0001 to ten millions; a
/// dash for NaN and infinity.
std::string number_text(double value, int digits = 4);

/// Three significant digits as C prints them: short, for messages.
std::string brief_text(double value);

/// A value, or a bound of its interval, with the decimals that two digits of the interval's width need.
std::string number_within(double value, double low, double high);

}  // namespace upright
