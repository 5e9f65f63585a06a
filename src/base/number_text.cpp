#include "number_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace upright {

namespace {

constexpr double min_plain = 1e-4, min_exponential = 1e7;

std::string printed(const char* format, int digits, double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, format, digits, value);
  return buffer;
}

/// The power of ten of the first digit: -1 of 0.25. By printing, which rounds alike on every machine; log10
/// of libm does not.
int decimal_exponent(double value) {
  const std::string text = printed("%.*e", 16, value);
  return std::atoi(text.c_str() + text.find('e') + 1);
}

/// 3.1e-07 as 3.1 × 10⁻⁷.
std::string with_power(const std::string& text) {
  constexpr const char* raised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  const std::size_t at = text.find('e');
  const int power = std::atoi(text.c_str() + at + 1);
  std::string result = text.substr(0, at) + " × 10" + (power < 0 ? "⁻" : "");
  for (const char digit : std::to_string(std::abs(power))) result += raised[digit - '0'];
  return result;
}

}  // namespace

std::string number_text(double value, int digits) {
  if (std::isnan(value)) return "-";
  digits = std::clamp(digits, 1, 17);
  const std::string text = printed("%.*g", digits, value);
  if (text.find('e') == std::string::npos) return text;
  // What rounding makes of it decides: 9999999.9 is ten millions.
  const double rounded = std::strtod(text.c_str(), nullptr);
  if (std::abs(rounded) >= min_plain && std::abs(rounded) < min_exponential)
    return printed("%.*f", 0, rounded);
  return with_power(text);
}

std::string brief_text(double value) {
  return printed("%.*g", 3, value);
}

std::string number_within(double value, double low, double high) {
  const double half_width = 0.5 * (high - low);
  if (!(half_width > 0.0) || !std::isfinite(half_width) || !std::isfinite(value))
    return number_text(value, 5);
  constexpr int max_decimals = 8;
  const int decimals = 1 - decimal_exponent(half_width);
  if (decimals > max_decimals || half_width >= min_exponential) return number_text(value, 5);
  // Without decimals, digits that the width does not bear become zeros.
  const double step = std::strtod(("1e" + std::to_string(-decimals)).c_str(), nullptr);
  const std::string text = printed("%.*f", std::max(decimals, 0), std::round(value / step) * step);
  return text.find_first_of("123456789") == std::string::npos && text.front() == '-' ? text.substr(1) : text;
}

}  // namespace upright
