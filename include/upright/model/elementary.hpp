// Elementary functions whose bits do not depend on the machine. libm picks its sin, exp, ... by the processor
// (with or without fused multiply-add) and changes them from release to release, so that a log written on one
// machine would not replay on another. These use additions, multiplications, divisions and square roots
// alone, which IEEE 754 rounds in one way. Errors are below 1 unit in the last place
// (tests/unit/elementary_test.cpp).
//
// Called by their qualified names, elementary::sin(x), they take every scalar of the physics: plain numbers,
// dual numbers, and scalars that bring functions of their own, as lanes do.
#pragma once

#include <cmath>
#include <type_traits>

namespace upright::elementary {

/// Beyond 2^20 quarter turns an angle counts whole turns of the double nearest to 2 pi.
double sin(double angle);
double cos(double angle);
double exp(double x);
/// exp(x) - 1, exact near 0 too.
double expm1(double x);
double log(double x);
double tanh(double x);
/// x^y for x >= 0. The relative error grows with |y log x|, one unit in the last place for each unit of it.
double power(double x, double y);
/// Length of (x, y) where the squares neither overflow nor underflow.
inline double hypot(double x, double y) {
  return std::sqrt(x * x + y * y);
}

template <class S>
struct SineAndCosine {
  S sine, cosine;
};
/// Both for little more than the price of one.
SineAndCosine<double> sine_and_cosine(double angle);

/// A dual number: `a` its value, `v` its derivatives (ceres::Jet).
template <class S>
concept Dual = requires(const S& x) {
  x.a;
  x.v;
};
/// Whatever is not a plain number.
template <class S>
concept Composed = std::is_class_v<S>;

template <Composed S>
S sin(const S& x) {
  if constexpr (Dual<S>) {
    const auto [s, c] = sine_and_cosine(x.a);
    return S(s, c * x.v);
  } else {
    return sin(x);  // the scalar's own
  }
}

template <Composed S>
SineAndCosine<S> sine_and_cosine(const S& x) {
  if constexpr (Dual<S>) {
    const auto [s, c] = sine_and_cosine(x.a);
    return {S(s, c * x.v), S(c, -s * x.v)};
  } else {
    return {sin(x), cos(x)};
  }
}

template <Composed S>
S exp(const S& x) {
  if constexpr (Dual<S>) {
    const double e = exp(x.a);
    return S(e, e * x.v);
  } else {
    return exp(x);
  }
}

template <Composed S>
S log(const S& x) {
  if constexpr (Dual<S>)
    return S(log(x.a), x.v * (1.0 / x.a));
  else
    return log(x);
}

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
