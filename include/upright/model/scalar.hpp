// Requirements of the physics on a scalar, so that the same code works with double, dual numbers
// (dual_number.hpp) and SIMD lanes. A SIMD type adds an overload of `select` for its comparison result;
// everything else follows.
#pragma once

namespace upright {

/// One of two values, selected by a condition. Both are evaluated, so that lanes may differ.
template <class S>
S select(bool condition, const S& yes, const S& no) {
  return condition ? yes : no;
}

/// The value of a scalar: itself for double, without derivatives for a dual number.
inline double value_of(double x) {
  return x;
}
/// The value of a dual number, without its derivatives.
template <class S>
requires requires(const S& x) {
  x.a;
}
double value_of(const S& x) {
  return x.a;
}

/// True when x equals `number`, without derivative and in every lane: for formulas with a cheaper form at
/// one value of a parameter. Scalars without an overload take the general form.
template <class S>
bool is_plainly(const S& /*x*/, double /*number*/) {
  return false;
}
/// The same for a plain number.
inline bool is_plainly(double x, double number) {
  return x == number;
}

/// Absolute value.
template <class S>
S absolute(const S& x) {
  return select(x < S(0.0), S(-x), x);
}

/// The smaller one.
template <class S>
S smaller(const S& a, const S& b) {
  return select(b < a, b, a);
}

/// The value where it is positive, otherwise 0.
template <class S>
S positive_part(const S& x) {
  return select(x > S(0.0), x, S(0.0));
}

/// The sign: -1, 0 or 1.
template <class S>
S sign_of(const S& x) {
  return select(x > S(0.0), S(1.0), select(x < S(0.0), S(-1.0), S(0.0)));
}

/// A number that many others are divided by. A scalar may have a faster way than the division.
template <class S>
class Divisor {
 public:
  /// Divides by this number.
  explicit Divisor(const S& value) : value_(value) {}
  /// The quotient.
  friend S operator/(const S& dividend, const Divisor& by) { return dividend / by.value_; }

 private:
  S value_;
};

}  // namespace upright
