// The approximations of sine, cosine, exp, expm1, log and tanh are those of fdlibm:
//
//   Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved.
//   Developed at SunPro, a Sun Microsystems, Inc. business. Permission to use, copy, modify, and distribute
//   this software is freely granted, provided that this notice is preserved.
//
// A constant in two parts has a first part with trailing zeros, whose product with a small integer is exact.
#include "upright/model/elementary.hpp"

#include <bit>
#include <cstdint>
#include <limits>
#include <numbers>

namespace upright::elementary {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double ln2_high = 6.93147180369123816490e-01, ln2_low = 1.90821492927058770002e-10;
constexpr int mantissa_bits = 52, exponent_bias = 1023;

/// 2^n for a normal number.
double power_of_two(int n) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(exponent_bias + n) << mantissa_bits);
}

/// To even on a tie, for |x| < 2^51. (Without SSE 4.1 std::nearbyint is a call.)
double nearest_integer(double x) {
  constexpr double shift = 0x1.8p52;  // the sum has no bit to spare for a fraction
  return (x + shift) - shift;
}

/// Sine for |x + rest| <= pi / 4.
double sine_kernel(double x, double rest) {
  constexpr double s1 = -1.66666666666666324348e-01, s2 = 8.33333333332248946124e-03,
                   s3 = -1.98412698298579493134e-04, s4 = 2.75573137070700676789e-06,
                   s5 = -2.50507602534068634195e-08, s6 = 1.58969099521155010221e-10;
  const double z = x * x, w = z * z;
  const double r = s2 + z * (s3 + z * s4) + z * w * (s5 + z * s6);
  const double cube = z * x;
  return x - ((z * (0.5 * rest - cube * r) - rest) - cube * s1);
}

/// Cosine for |x + rest| <= pi / 4.
double cosine_kernel(double x, double rest) {
  constexpr double c1 = 4.16666666666666019037e-02, c2 = -1.38888888888741095749e-03,
                   c3 = 2.48015872894767294178e-05, c4 = -2.75573143513906633035e-07,
                   c5 = 2.08757232129817482790e-09, c6 = -1.13596475577881948265e-11;
  const double z = x * x, w = z * z;
  const double r = z * (c1 + z * (c2 + z * c3)) + w * w * (c4 + z * (c5 + z * c6));
  const double half = 0.5 * z, most = 1.0 - half;
  return most + (((1.0 - most) - half) + (z * r - x * rest));
}

/// An angle as high + low within pi / 4 of a multiple of pi / 2.
struct ReducedAngle {
  double high, low;
  unsigned quarter_turns;  ///< modulo 4
};

ReducedAngle reduced(double angle) {
  constexpr double direct = 0.78539816339744827900;  // pi / 4
  if (std::abs(angle) <= direct) return {angle, 0.0, 0};
  // Up to so many quarter turns the products with the parts of pi / 2, of 33 bits each, are exact.
  constexpr double max_quarter_turns = 1 << 20;
  constexpr double quarter_turns_per_rad = 2.0 / std::numbers::pi;
  constexpr double first = 1.57079632673412561417e+00, second = 6.07710050630396597660e-11,
                   third = 2.02226624879595063154e-21;
  if (!(std::abs(angle) * quarter_turns_per_rad < max_quarter_turns))
    angle = std::remainder(angle, 2.0 * std::numbers::pi);
  const double turns = nearest_integer(angle * quarter_turns_per_rad);
  const double near = angle - turns * first;
  const double nearer = near - turns * second;
  const double low = turns * third - ((near - nearer) - turns * second);
  const double high = nearer - low;
  return {high, (nearer - high) - low, static_cast<unsigned>(static_cast<int>(turns)) & 3u};
}

/// Sine of an angle that was reduced, after so many quarter turns.
double sine_of(const ReducedAngle& r, unsigned quarter_turns) {
  const double value = (quarter_turns & 1u) != 0 ? cosine_kernel(r.high, r.low) : sine_kernel(r.high, r.low);
  return (quarter_turns & 2u) != 0 ? -value : value;
}

}  // namespace

double sin(double angle) {
  if (!std::isfinite(angle)) return angle - angle;
  const ReducedAngle r = reduced(angle);
  return sine_of(r, r.quarter_turns);
}

double cos(double angle) {
  if (!std::isfinite(angle)) return angle - angle;
  const ReducedAngle r = reduced(angle);
  return sine_of(r, r.quarter_turns + 1);
}

SineAndCosine<double> sine_and_cosine(double angle) {
  if (!std::isfinite(angle)) return {angle - angle, angle - angle};
  const ReducedAngle r = reduced(angle);
  return {sine_of(r, r.quarter_turns), sine_of(r, r.quarter_turns + 1)};
}

double exp(double x) {
  constexpr double p1 = 1.66666666666666019037e-01, p2 = -2.77777777770155933842e-03,
                   p3 = 6.61375632143793436117e-05, p4 = -1.65339022054652515390e-06,
                   p5 = 4.13813679705723846039e-08;
  constexpr double overflows_above = 7.09782712893383973096e+02, vanishes_below = -7.45133219101941108420e+02;
  if (x > overflows_above) return infinity;
  if (x < vanishes_below) return 0.0;
  if (x != x) return x;
  const double doublings = nearest_integer(x * std::numbers::log2e);
  const double high = x - doublings * ln2_high, low = doublings * ln2_low;
  const double r = high - low, square = r * r;
  const double c = r - square * (p1 + square * (p2 + square * (p3 + square * (p4 + square * p5))));
  const double mantissa = 1.0 + ((r * c / (2.0 - c) - low) + high);
  // In two factors: 2^1024 is no number, and 2^-1074 no normal one.
  const int n = static_cast<int>(doublings), half = n / 2;
  return mantissa * power_of_two(half) * power_of_two(n - half);
}

double expm1(double x) {
  constexpr double q1 = -3.33333333333331316428e-02, q2 = 1.58730158725481460165e-03,
                   q3 = -7.93650757867487942473e-05, q4 = 4.00821782732936239552e-06,
                   q5 = -2.01099218183624371326e-07;
  constexpr double all_lost_below = -40.0, one_negligible_above = 40.0;  // exp(-40) is 4e-18
  if (x != x) return x;
  if (x < all_lost_below) return -1.0;
  if (x > one_negligible_above) return exp(x);
  constexpr double half_ln2 = 0.5 * std::numbers::ln2;
  const double doublings = std::abs(x) <= half_ln2 ? 0.0 : nearest_integer(x * std::numbers::log2e);
  const double high = x - doublings * ln2_high, low = doublings * ln2_low;
  const double r = high - low, lost = (high - r) - low;
  const double half = 0.5 * r, product = r * half;
  const double sum = 1.0 + product * (q1 + product * (q2 + product * (q3 + product * (q4 + product * q5))));
  const double t = 3.0 - sum * half;
  const double e = product * ((sum - t) / (6.0 - r * t));
  if (doublings == 0.0) return r - (r * e - product);
  // exp(r) - 1 = r - error
  const double error = (r * (e - lost) - lost) - product;
  const int n = static_cast<int>(doublings);
  if (n == -1) return 0.5 * (r - error) - 0.5;
  if (n == 1) return r < -0.25 ? -2.0 * (error - (r + 0.5)) : 1.0 + 2.0 * (r - error);
  const double scale = power_of_two(n), inverse = power_of_two(-n);
  constexpr int half_the_bits = 20;
  if (n < half_the_bits && n > 0) return ((1.0 - inverse) - (error - r)) * scale;
  if (n > 0) return ((r - (error + inverse)) + 1.0) * scale;
  return (1.0 - (error - r)) * scale - 1.0;
}

double log(double x) {
  constexpr double l1 = 6.666666666666735130e-01, l2 = 3.999999999940941908e-01,
                   l3 = 2.857142874366239149e-01, l4 = 2.222219843214978396e-01,
                   l5 = 1.818357216161805012e-01, l6 = 1.531383769920937332e-01,
                   l7 = 1.479819860511658591e-01;
  if (x == 0.0) return -infinity;
  if (x < 0.0) return std::numeric_limits<double>::quiet_NaN();
  if (!(x < infinity)) return x;
  int n = 0;
  if (x < std::numeric_limits<double>::min()) {
    constexpr int to_normal = 54;
    x *= power_of_two(to_normal);
    n = -to_normal;
  }
  // x = 2^n m with m from sqrt(1/2) to sqrt(2)
  const auto bits = std::bit_cast<std::uint64_t>(x);
  n += static_cast<int>(bits >> mantissa_bits) - exponent_bias;
  double m = std::bit_cast<double>((bits & ((std::uint64_t{1} << mantissa_bits) - 1)) |
                                   std::bit_cast<std::uint64_t>(1.0));
  if (m > std::numbers::sqrt2) {
    m *= 0.5;
    ++n;
  }
  const double f = m - 1.0, half_square = 0.5 * f * f, s = f / (2.0 + f);
  const double z = s * s, w = z * z;
  const double even = w * (l2 + w * (l4 + w * l6)), odd = z * (l1 + w * (l3 + w * (l5 + w * l7)));
  return s * (half_square + (even + odd)) + n * ln2_low - half_square + f + n * ln2_high;
}

double tanh(double x) {
  const double size = std::abs(x);
  constexpr double saturated = 22.0;  // from here on 1 is the nearest number
  double t = 0.0;
  if (size > saturated) {
    t = 1.0;
  } else if (size > 1.0) {
    t = 1.0 - 2.0 / (expm1(2.0 * size) + 2.0);
  } else {
    const double e = expm1(-2.0 * size);
    t = -e / (e + 2.0);
  }
  return x < 0.0 ? -t : (x == 0.0 || x != x ? x : t);
}

double power(double x, double y) {
  if (y == 0.0 || x == 1.0) return 1.0;
  return exp(y * log(x));
}

}  // namespace upright::elementary
