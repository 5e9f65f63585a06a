// What the physics asks of a scalar, so that the same text runs on double, on dual numbers (ceres::Jet) and
// on SIMD lanes. A SIMD type adds an overload of `select` for its own comparison result; everything else
// follows from it.
#pragma once

namespace upright {

/// Either of two values by a condition; both are evaluated, so that lanes may differ.
template <class S>
S select(bool condition, const S& yes, const S& no) {
  return condition ? yes : no;
}

/// The plain number in a scalar: itself for double, the value part of a dual number.
inline double value_of(double x) {
  return x;
}
template <class S>
requires requires(const S& x) {
  x.a;
}
double value_of(const S& x) {
  return x.a;
}

/// True when x is this very number, with no derivative and in every lane: where a formula has a cheaper form
/// for one value of a parameter. Scalars that do not say so take the general form.
template <class S>
bool is_plainly(const S& /*x*/, double /*number*/) {
  return false;
}
inline bool is_plainly(double x, double number) {
  return x == number;
}

template <class S>
S absolute(const S& x) {
  return select(x < S(0.0), S(-x), x);
}

template <class S>
S positive_part(const S& x) {
  return select(x > S(0.0), x, S(0.0));
}

/// -1, 0 or 1.
template <class S>
S sign_of(const S& x) {
  return select(x > S(0.0), S(1.0), select(x < S(0.0), S(-1.0), S(0.0)));
}

}  // namespace upright
