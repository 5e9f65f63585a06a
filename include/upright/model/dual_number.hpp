// Dual numbers: a value with N derivatives, which arithmetic carries along. This is forward-mode automatic
// differentiation (Griewank and Walther, Evaluating Derivatives, 2nd ed., section 3.1). The derivatives are
// SIMD vectors of the compiler. Fits with ceres::Jet, which uses expressions of Eigen, are as fast, but took
// twice as long to compile.
//
// Comparisons are of the values. Functions other than the square root are in elementary.hpp.
#pragma once

#include <cmath>
#include <utility>

namespace upright {

// Left to itself the compiler calls these through memory, which takes longer than what they do.
#define UPRIGHT_DUAL_INLINE [[gnu::always_inline]] inline

/// N derivatives, as a row. Lanes beyond N are 0.
template <int N>
class Derivatives {
 public:
  /// As many as a SIMD register of x86-64-v3 holds.
  static constexpr int lanes = 4;
  /// SIMD vectors that hold the derivatives.
  static constexpr int vectors = (N + lanes - 1) / lanes;

  /// All 0.
  UPRIGHT_DUAL_INLINE Derivatives() : vector_{} {}
  /// 1 at a place, otherwise 0.
  static Derivatives unit(int place) {
    Derivatives result;
    result.set(place, 1.0);
    return result;
  }

  /// The derivative at a place.
  UPRIGHT_DUAL_INLINE double operator[](int place) const { return vector_[place / lanes][place % lanes]; }
  /// Sets the derivative at a place.
  UPRIGHT_DUAL_INLINE void set(int place, double value) { vector_[place / lanes][place % lanes] = value; }

  /// Sets the first `count` to 0.
  void clear_first(int count) {
    for (int i = 0; i < count; ++i) set(i, 0.0);
  }
  /// Adds factor * b, at least in the places from `first` on.
  UPRIGHT_DUAL_INLINE void add_from(int first, double factor, const Derivatives& b) {
    for (int i = first / lanes; i < vectors; ++i) vector_[i] += factor * b.vector_[i];
  }

  /// Adds.
  UPRIGHT_DUAL_INLINE Derivatives& operator+=(const Derivatives& b) { return *this = *this + b; }
  /// Subtracts.
  UPRIGHT_DUAL_INLINE Derivatives& operator-=(const Derivatives& b) { return *this = *this - b; }
  /// Multiplies.
  UPRIGHT_DUAL_INLINE Derivatives& operator*=(double factor) { return *this = factor * *this; }

  /// Sum.
  UPRIGHT_DUAL_INLINE friend Derivatives operator+(const Derivatives& a, const Derivatives& b) {
    return of([&](int i) { return a.vector_[i] + b.vector_[i]; });
  }
  /// Difference.
  UPRIGHT_DUAL_INLINE friend Derivatives operator-(const Derivatives& a, const Derivatives& b) {
    return of([&](int i) { return a.vector_[i] - b.vector_[i]; });
  }
  /// Negative.
  UPRIGHT_DUAL_INLINE friend Derivatives operator-(const Derivatives& a) {
    return of([&](int i) { return -a.vector_[i]; });
  }
  /// Product.
  UPRIGHT_DUAL_INLINE friend Derivatives operator*(double factor, const Derivatives& a) {
    return of([&](int i) { return factor * a.vector_[i]; });
  }
  /// Product.
  UPRIGHT_DUAL_INLINE friend Derivatives operator*(const Derivatives& a, double factor) { return factor * a; }
  /// Quotient.
  UPRIGHT_DUAL_INLINE friend Derivatives operator/(const Derivatives& a, double divisor) {
    return (1.0 / divisor) * a;
  }

 private:
  using Vector [[gnu::vector_size(lanes * sizeof(double))]] = double;

  /// With these vectors. Unrolled, so that they stay in registers.
  template <class F>
  UPRIGHT_DUAL_INLINE static Derivatives of(const F& vector) {
    return of(vector, std::make_integer_sequence<int, vectors>());
  }
  template <class F, int... i>
  UPRIGHT_DUAL_INLINE static Derivatives of(const F& vector, std::integer_sequence<int, i...> /*places*/) {
    return Derivatives(vector(i)...);
  }
  template <class... V>
  UPRIGHT_DUAL_INLINE explicit Derivatives(const V&... vector) requires(sizeof...(V) == vectors)
      : vector_{vector...} {}

  Vector vector_[vectors];
};

/// A number with N derivatives.
template <int N>
struct DualNumber {
  double a = 0.0;    ///< the value
  Derivatives<N> v;  ///< the derivatives

  /// 0, a constant.
  DualNumber() = default;
  /// A constant: all derivatives are 0.
  UPRIGHT_DUAL_INLINE explicit DualNumber(double value) : a(value) {}
  /// The variable number `place`.
  UPRIGHT_DUAL_INLINE DualNumber(double value, int place) : a(value), v(Derivatives<N>::unit(place)) {}
  /// A value with its derivatives.
  UPRIGHT_DUAL_INLINE DualNumber(double value, const Derivatives<N>& derivatives)
      : a(value), v(derivatives) {}

  /// Adds.
  UPRIGHT_DUAL_INLINE DualNumber& operator+=(const DualNumber& y) { return *this = *this + y; }
  /// Subtracts.
  UPRIGHT_DUAL_INLINE DualNumber& operator-=(const DualNumber& y) { return *this = *this - y; }
  /// Multiplies.
  UPRIGHT_DUAL_INLINE DualNumber& operator*=(const DualNumber& y) { return *this = *this * y; }
  /// Divides.
  UPRIGHT_DUAL_INLINE DualNumber& operator/=(const DualNumber& y) { return *this = *this / y; }
  /// Adds.
  UPRIGHT_DUAL_INLINE DualNumber& operator+=(double y) { return *this = *this + y; }
  /// Subtracts.
  UPRIGHT_DUAL_INLINE DualNumber& operator-=(double y) { return *this = *this - y; }
  /// Multiplies.
  UPRIGHT_DUAL_INLINE DualNumber& operator*=(double y) { return *this = *this * y; }
  /// Divides.
  UPRIGHT_DUAL_INLINE DualNumber& operator/=(double y) { return *this = *this / y; }

  /// Negative.
  UPRIGHT_DUAL_INLINE friend DualNumber operator-(const DualNumber& x) { return {-x.a, -x.v}; }

  /// Sum.
  UPRIGHT_DUAL_INLINE friend DualNumber operator+(const DualNumber& x, const DualNumber& y) {
    return {x.a + y.a, x.v + y.v};
  }
  /// Sum.
  UPRIGHT_DUAL_INLINE friend DualNumber operator+(const DualNumber& x, double y) { return {x.a + y, x.v}; }
  /// Sum.
  UPRIGHT_DUAL_INLINE friend DualNumber operator+(double x, const DualNumber& y) { return {x + y.a, y.v}; }

  /// Difference.
  UPRIGHT_DUAL_INLINE friend DualNumber operator-(const DualNumber& x, const DualNumber& y) {
    return {x.a - y.a, x.v - y.v};
  }
  /// Difference.
  UPRIGHT_DUAL_INLINE friend DualNumber operator-(const DualNumber& x, double y) { return {x.a - y, x.v}; }
  /// Difference.
  UPRIGHT_DUAL_INLINE friend DualNumber operator-(double x, const DualNumber& y) { return {x - y.a, -y.v}; }

  /// Product.
  UPRIGHT_DUAL_INLINE friend DualNumber operator*(const DualNumber& x, const DualNumber& y) {
    return {x.a * y.a, x.a * y.v + y.a * x.v};
  }
  /// Product.
  UPRIGHT_DUAL_INLINE friend DualNumber operator*(const DualNumber& x, double y) {
    return {x.a * y, x.v * y};
  }
  /// Product.
  UPRIGHT_DUAL_INLINE friend DualNumber operator*(double x, const DualNumber& y) {
    return {x * y.a, x * y.v};
  }

  /// Quotient.
  UPRIGHT_DUAL_INLINE friend DualNumber operator/(const DualNumber& x, const DualNumber& y) {
    const double inverse = 1.0 / y.a;
    const double quotient = x.a * inverse;
    return {quotient, (x.v - quotient * y.v) * inverse};
  }
  /// Quotient.
  UPRIGHT_DUAL_INLINE friend DualNumber operator/(const DualNumber& x, double y) {
    const double inverse = 1.0 / y;
    return {x.a * inverse, x.v * inverse};
  }
  /// Quotient.
  UPRIGHT_DUAL_INLINE friend DualNumber operator/(double x, const DualNumber& y) {
    return {x / y.a, y.v * (-x / (y.a * y.a))};
  }

  /// Compares the values.
  UPRIGHT_DUAL_INLINE friend bool operator<(const DualNumber& x, const DualNumber& y) { return x.a < y.a; }
  /// Compares the values.
  UPRIGHT_DUAL_INLINE friend bool operator<=(const DualNumber& x, const DualNumber& y) { return x.a <= y.a; }
  /// Compares the values.
  UPRIGHT_DUAL_INLINE friend bool operator>(const DualNumber& x, const DualNumber& y) { return x.a > y.a; }
  /// Compares the values.
  UPRIGHT_DUAL_INLINE friend bool operator>=(const DualNumber& x, const DualNumber& y) { return x.a >= y.a; }
  /// Compares the values.
  UPRIGHT_DUAL_INLINE friend bool operator==(const DualNumber& x, const DualNumber& y) { return x.a == y.a; }
};

/// The square root. At 0 its derivatives are not finite.
template <int N>
UPRIGHT_DUAL_INLINE DualNumber<N> sqrt(const DualNumber<N>& x) {
  const double root = std::sqrt(x.a);
  return {root, x.v * (0.5 / root)};
}

#undef UPRIGHT_DUAL_INLINE

}  // namespace upright
