// Elementary functions with machine-independent results. libm selects sin, exp, ... by processor (with or
// without fused multiply-add) and changes them between releases, so that a log written on one machine
// would not replay on another. The functions here use additions, multiplications, divisions and square
// roots only, which IEEE 754 rounds uniquely. Errors are below 1 unit in the last place
// (tests/unit/elementary_test.cpp).
//
// Called by their qualified names, elementary::sin(x), they accept every scalar of the physics: double,
// dual numbers, and scalars with own functions, such as lanes.
#pragma once

#include <cmath>
#include <type_traits>

namespace upright::elementary {

/// Beyond 2^20 quarter turns, the period is the double nearest to 2 pi.
double sin(double angle);
double cos(double angle);  ///< cosine; `angle` in [rad]
double exp(double x);      ///< exponential function
/// exp(x) - 1, accurate near 0 too.
double expm1(double x);
double log(double x);   ///< natural logarithm
double tanh(double x);  ///< hyperbolic tangent
/// x^y for x >= 0. The relative error grows with |y log x|, by one unit in the last place per unit.
double power(double x, double y);
/// Square root of x^2 + y^2, where the squares neither overflow nor underflow.
inline double hypot(double x, double y) {
  return std::sqrt(x * x + y * y);
}

/// Both of one angle.
template <class S>
struct SineAndCosine {
  S sine;    ///< of the angle
  S cosine;  ///< of the angle
};
/// Both, at little more than the cost of one.
SineAndCosine<double> sine_and_cosine(double angle);

/// A dual number, as DualNumber: `a` is its value, `v` are its derivatives.
template <class S>
concept Dual = requires(const S& x) {
  x.a;
  x.v;
};
/// All scalars other than double.
template <class S>
concept Composed = std::is_class_v<S>;

/// The same for other scalars, with derivatives.
template <Composed S>
S sin(const S& x) {
  if constexpr (Dual<S>) {
    const auto [s, c] = sine_and_cosine(x.a);
    return S(s, c * x.v);
  } else {
    return sin(x);  // the scalar's own function
  }
}

/// The same for other scalars, with derivatives.
template <Composed S>
SineAndCosine<S> sine_and_cosine(const S& x) {
  if constexpr (Dual<S>) {
    const auto [s, c] = sine_and_cosine(x.a);
    return {S(s, c * x.v), S(c, -s * x.v)};
  } else if constexpr (requires { both_of(x); }) {
    return both_of(x);  // at little more than the cost of one
  } else {
    return {sin(x), cos(x)};
  }
}

/// The same for other scalars, with derivatives. Inlined where lanes need it several times with one argument.
template <Composed S>
[[gnu::always_inline]] inline S exp(const S& x) {
  if constexpr (Dual<S>) {
    const double e = exp(x.a);
    return S(e, e * x.v);
  } else {
    return exp(x);
  }
}

/// The same for other scalars, with derivatives.
template <Composed S>
S log(const S& x) {
  if constexpr (Dual<S>)
    return S(log(x.a), x.v * (1.0 / x.a));
  else
    return log(x);
}

/// The same for other scalars, with derivatives.
template <Composed S>
S tanh(const S& x) {
  if constexpr (Dual<S>) {
    const double t = tanh(x.a);
    return S(t, (1.0 - t * t) * x.v);
  } else {
    return tanh(x);
  }
}

}  // namespace upright::elementary
