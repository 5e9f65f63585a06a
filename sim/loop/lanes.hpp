// A scalar that is many: runs side by side in SIMD registers, for the generic physics. Two registers
// of eight on AVX-512, of four on AVX2, of two on the baseline, so that one hides the latency of the other. A
// comparison gives a LaneMask, with which `select` chooses lane by lane.
//
// The functions are as exact as the sweeps need (relative 2e-12, angles of any size), not correctly rounded.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

// GCC 12 takes its own AVX-512 intrinsics for uses of uninitialised values (bug 105593).
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <xsimd/xsimd.hpp>
#pragma GCC diagnostic pop

#include "upright/model/elementary.hpp"

// Left to itself the compiler calls these through memory, which takes longer than what they do.
#define UPRIGHT_LANES_INLINE [[gnu::always_inline]] inline

namespace upright {

/// How many runs go side by side. Two registers, so that one hides the latency of the other; more would not
/// stay in registers.
constexpr std::size_t lane_count = 2 * xsimd::batch<double>::size;

namespace lanes_detail {

using Batch = xsimd::batch<double>;
using BatchBits = xsimd::batch<std::int64_t>;
using BatchBool = xsimd::batch_bool<double>;
constexpr std::size_t parts = lane_count / Batch::size;
static_assert(parts * Batch::size == lane_count);

/// 1 / x for finite x that is not 0.
UPRIGHT_LANES_INLINE Batch inverse(const Batch& x) {
#ifdef __AVX512F__
  // An estimate of 14 bits and one step of third order: a division would occupy the port four times as long.
  const Batch estimate = _mm512_rcp14_pd(x);
  const Batch error = xsimd::fnma(x, estimate, Batch(1.0));
  return xsimd::fma(estimate, xsimd::fma(error, error, error), estimate);
#else
  return Batch(1.0) / x;
#endif
}

/// The numbers at these places.
UPRIGHT_LANES_INLINE Batch gathered(const double* numbers, const std::uint32_t* places) {
#ifdef __AVX512F__
  return _mm512_i32gather_pd(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(places)), numbers,
                             sizeof(double));
#else
  std::array<double, Batch::size> found;
  for (std::size_t i = 0; i < found.size(); ++i) found[i] = numbers[places[i]];
  return Batch::load_unaligned(found.data());
#endif
}

/// Horner's rule; the coefficients begin with the highest power.
template <class... C>
UPRIGHT_LANES_INLINE Batch polynomial(const Batch& x, double highest, C... others) {
  Batch sum(highest);
  ((sum = xsimd::fma(sum, x, Batch(others))), ...);
  return sum;
}

// The polynomials interpolate at Chebyshev's points, so that the error is even over the range.

/// e^x. Overflows to infinity and underflows to 0 (without AVX-512 it stays at e^+-700).
UPRIGHT_LANES_INLINE Batch exponential(Batch x) {
  constexpr double log2_e = 1.4426950408889634, ln_2 = 0.6931471805599453, magic = 6755399441055744.0;
#ifndef __AVX512F__
  x = xsimd::min(xsimd::max(x, Batch(-700.0)), Batch(700.0));
#endif
  const Batch shifted = xsimd::fma(x, Batch(log2_e), Batch(magic));  // the integer ends up in the low bits
  const Batch exponent = shifted - Batch(magic);
  const Batch r = xsimd::fnma(exponent, Batch(ln_2), x);
  const Batch mantissa = polynomial(r, 2.487617898687754e-05, 0.00019915881872207094, 0.0013888821650620397,
                                    0.008333266071020688, 0.041666666891092684, 0.16666666891180554,
                                    0.4999999999979777, 0.999999999979769, 1.0);
#ifdef __AVX512F__
  return _mm512_scalef_pd(mantissa, exponent);
#else
  return xsimd::bitwise_cast<Batch>(xsimd::bitwise_cast<BatchBits>(mantissa) +
                                    (xsimd::bitwise_cast<BatchBits>(shifted) << 52));
#endif
}

/// tanh x: exact to 1e-12 absolutely, and 0 at 0.
UPRIGHT_LANES_INLINE Batch hyperbolic_tangent(const Batch& x) {
  constexpr double saturated = 50.0;  // from half of it on tanh is 1
  const Batch e = exponential(xsimd::min(x + x, Batch(saturated)));
  return xsimd::fnma(Batch(2.0), inverse(e + Batch(1.0)), Batch(1.0));
}

/// Angles to within +-pi/2 of a multiple of pi, and the sign that brings.
struct Reduced {
  Batch angle;
  Batch sign;
};

constexpr double direct_angle = 1.2;  // up to here the polynomials need no reduction

UPRIGHT_LANES_INLINE Reduced reduced(const Batch& x) {
  constexpr double pi_high = 3.141592653589793, pi_low = 1.2246467991473532e-16;
  const Batch turns = xsimd::nearbyint(x * Batch(1.0 / pi_high));
  const Batch angle = xsimd::fnma(turns, Batch(pi_low), xsimd::fnma(turns, Batch(pi_high), x));
  const Batch half = turns * Batch(0.5);
  const Batch odd = xsimd::abs(half - xsimd::nearbyint(half));  // 0 or 1/2
  return {angle, xsimd::fnma(Batch(4.0), odd, Batch(1.0))};
}

UPRIGHT_LANES_INLINE Batch sine_polynomial(const Batch& x) {
  return x * polynomial(x * x, 1.5411092885176819e-10, -2.5030259580271368e-08, 2.7556952695615513e-06,
                        -0.0001984126668062928, 0.008333333320345492, -0.16666666666466434,
                        0.9999999999999496);
}

UPRIGHT_LANES_INLINE Batch cosine_polynomial(const Batch& x) {
  return polynomial(x * x, 1.9907316483255068e-09, -2.752465755458485e-07, 2.4801039603107745e-05,
                    -0.0013888884167046435, 0.04166666647265931, -0.49999999997009187, 0.9999999999992469);
}

UPRIGHT_LANES_INLINE bool needs_reduction(const Batch& x) {
  return xsimd::any(xsimd::abs(x) > Batch(direct_angle));
}

UPRIGHT_LANES_INLINE Batch sine(const Batch& x) {
  if (!needs_reduction(x)) return sine_polynomial(x);
  const Reduced r = reduced(x);
  return r.sign * sine_polynomial(r.angle);
}

UPRIGHT_LANES_INLINE Batch cosine(const Batch& x) {
  if (!needs_reduction(x)) return cosine_polynomial(x);
  const Reduced r = reduced(x);
  return r.sign * cosine_polynomial(r.angle);
}

}  // namespace lanes_detail

/// One truth value per lane.
struct LaneMask {
  std::array<lanes_detail::BatchBool, lanes_detail::parts> part;

  UPRIGHT_LANES_INLINE friend LaneMask operator&(LaneMask a, const LaneMask& b) {
    for (std::size_t i = 0; i < a.part.size(); ++i) a.part[i] = a.part[i] & b.part[i];
    return a;
  }
  UPRIGHT_LANES_INLINE friend LaneMask operator|(LaneMask a, const LaneMask& b) {
    for (std::size_t i = 0; i < a.part.size(); ++i) a.part[i] = a.part[i] | b.part[i];
    return a;
  }
  UPRIGHT_LANES_INLINE friend LaneMask operator!(LaneMask a) {
    for (auto& p : a.part) p = !p;
    return a;
  }
  UPRIGHT_LANES_INLINE friend bool any(const LaneMask& a) {
    auto joined = a.part[0];
    for (std::size_t i = 1; i < a.part.size(); ++i) joined = joined | a.part[i];
    return xsimd::any(joined);
  }
  UPRIGHT_LANES_INLINE friend bool all(const LaneMask& a) {
    auto joined = a.part[0];
    for (std::size_t i = 1; i < a.part.size(); ++i) joined = joined & a.part[i];
    return xsimd::all(joined);
  }
  /// Bit i: lane i.
  std::uint32_t bits() const {
    std::uint32_t word = 0;
#ifdef __AVX512F__
    for (std::size_t i = 0; i < part.size(); ++i)
      word |= static_cast<std::uint32_t>(part[i].data) << (i * lanes_detail::Batch::size);
#else
    std::array<bool, lane_count> truth;
    for (std::size_t i = 0; i < part.size(); ++i)
      part[i].store_unaligned(truth.data() + i * lanes_detail::Batch::size);
    for (std::size_t lane = 0; lane < lane_count; ++lane)
      word |= static_cast<std::uint32_t>(truth[lane]) << lane;
#endif
    return word;
  }
};

/// A mask that leaves out no lane, where all go in step: `select` costs nothing.
struct EveryLane {
  friend bool any(EveryLane) { return true; }
  friend LaneMask operator&(EveryLane, const LaneMask& b) { return b; }
};

/// One number for each run.
class Lanes {
 public:
  using Batch = lanes_detail::Batch;

  Lanes() : Lanes(0.0) {}
  Lanes(double everywhere) {
    part_.fill(Batch(everywhere));
  }  // NOLINT: numbers mix with lanes as with doubles
  static Lanes load(const double* numbers) {
    Lanes lanes;
    for (std::size_t i = 0; i < lanes.part_.size(); ++i)
      lanes.part_[i] = Batch::load_unaligned(numbers + i * Batch::size);
    return lanes;
  }
  /// The numbers at these places.
  static Lanes gather(const double* numbers, const std::array<std::uint32_t, lane_count>& places) {
    Lanes lanes(uninitialised{});
    for (std::size_t i = 0; i < lanes.part_.size(); ++i)
      lanes.part_[i] = lanes_detail::gathered(numbers, places.data() + i * Batch::size);
    return lanes;
  }
  /// By register.
  using Parts = std::array<Batch, lanes_detail::parts>;
  explicit Lanes(const Parts& parts) : part_(parts) {}
  const Parts& parts() const { return part_; }
  void store(double* numbers) const {
    for (std::size_t i = 0; i < part_.size(); ++i) part_[i].store_unaligned(numbers + i * Batch::size);
  }
  std::array<double, lane_count> values() const {
    std::array<double, lane_count> numbers;
    store(numbers.data());
    return numbers;
  }

  /// Changes the number of one lane.
  friend void put(Lanes& lanes, std::size_t lane, double number) {
    auto numbers = lanes.values();
    numbers[lane] = number;
    lanes = load(numbers.data());
  }

  Lanes& operator+=(const Lanes& b) { return *this = *this + b; }

  UPRIGHT_LANES_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Batch& x, const Batch& y) { return x + y; });
  }
  UPRIGHT_LANES_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Batch& x, const Batch& y) { return x - y; });
  }
  UPRIGHT_LANES_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Batch& x, const Batch& y) { return x * y; });
  }
  UPRIGHT_LANES_INLINE friend Lanes operator/(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Batch& x, const Batch& y) { return x * lanes_detail::inverse(y); });
  }
  /// 1 / a for a that is finite and not 0.
  UPRIGHT_LANES_INLINE friend Lanes inverse(const Lanes& a) { return map(a, lanes_detail::inverse); }
  UPRIGHT_LANES_INLINE friend Lanes operator-(const Lanes& a) {
    return map(a, [](const Batch& x) { return -x; });
  }
  UPRIGHT_LANES_INLINE friend LaneMask operator<(const Lanes& a, const Lanes& b) {
    return compare(a, b, [](const Batch& x, const Batch& y) { return x < y; });
  }
  UPRIGHT_LANES_INLINE friend LaneMask operator>(const Lanes& a, const Lanes& b) { return b < a; }
  UPRIGHT_LANES_INLINE friend LaneMask operator<=(const Lanes& a, const Lanes& b) {
    return compare(a, b, [](const Batch& x, const Batch& y) { return x <= y; });
  }
  UPRIGHT_LANES_INLINE friend LaneMask operator>=(const Lanes& a, const Lanes& b) { return b <= a; }
  UPRIGHT_LANES_INLINE friend LaneMask operator==(const Lanes& a, const Lanes& b) {
    return compare(a, b, [](const Batch& x, const Batch& y) { return x == y; });
  }

  UPRIGHT_LANES_INLINE friend Lanes select(const LaneMask& condition, const Lanes& yes, const Lanes& no) {
    Lanes result(uninitialised{});
    for (std::size_t i = 0; i < result.part_.size(); ++i)
      result.part_[i] = xsimd::select(condition.part[i], yes.part_[i], no.part_[i]);
    return result;
  }
  UPRIGHT_LANES_INLINE friend Lanes select(EveryLane, const Lanes& yes, const Lanes& /*no*/) { return yes; }
  UPRIGHT_LANES_INLINE friend Lanes absolute(const Lanes& a) {
    return map(a, [](const Batch& x) { return xsimd::abs(x); });
  }
  UPRIGHT_LANES_INLINE friend Lanes positive_part(const Lanes& a) {
    return map(a, [](const Batch& x) { return xsimd::max(x, Batch(0.0)); });
  }
  UPRIGHT_LANES_INLINE friend Lanes smaller(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Batch& x, const Batch& y) { return xsimd::min(x, y); });
  }
  UPRIGHT_LANES_INLINE friend Lanes larger(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Batch& x, const Batch& y) { return xsimd::max(x, y); });
  }
  UPRIGHT_LANES_INLINE friend Lanes round(const Lanes& a) {
    // To even on a tie, where std::round goes away from zero: a tie needs a count that is exactly half.
    return map(a, [](const Batch& x) { return xsimd::nearbyint(x); });
  }
  UPRIGHT_LANES_INLINE friend Lanes sin(const Lanes& a) { return map(a, lanes_detail::sine); }
  UPRIGHT_LANES_INLINE friend Lanes cos(const Lanes& a) { return map(a, lanes_detail::cosine); }
  UPRIGHT_LANES_INLINE friend elementary::SineAndCosine<Lanes> both_of(const Lanes& angle) {
    if (!any(absolute(angle) > Lanes(lanes_detail::direct_angle)))
      return {map(angle, lanes_detail::sine_polynomial), map(angle, lanes_detail::cosine_polynomial)};
    elementary::SineAndCosine<Lanes> both{Lanes(uninitialised{}), Lanes(uninitialised{})};
    for (std::size_t i = 0; i < angle.part_.size(); ++i) {
      const lanes_detail::Reduced r = lanes_detail::reduced(angle.part_[i]);
      both.sine.part_[i] = r.sign * lanes_detail::sine_polynomial(r.angle);
      both.cosine.part_[i] = r.sign * lanes_detail::cosine_polynomial(r.angle);
    }
    return both;
  }
  UPRIGHT_LANES_INLINE friend Lanes exp(const Lanes& a) { return map(a, lanes_detail::exponential); }
  UPRIGHT_LANES_INLINE friend Lanes tanh(const Lanes& a) { return map(a, lanes_detail::hyperbolic_tangent); }
  UPRIGHT_LANES_INLINE friend Lanes log(const Lanes& a) {
    return map(a, [](const Batch& x) { return xsimd::log(x); });
  }
  UPRIGHT_LANES_INLINE friend Lanes sqrt(const Lanes& a) {
    return map(a, [](const Batch& x) { return xsimd::sqrt(x); });
  }
  /// True when every lane is this very number.
  UPRIGHT_LANES_INLINE friend bool is_plainly(const Lanes& a, double number) {
    return all(a == Lanes(number));
  }

 private:
  struct uninitialised {};
  explicit Lanes(uninitialised) {}

  template <class F>
  UPRIGHT_LANES_INLINE static Lanes map(const Lanes& a, F&& f) {
    Lanes result(uninitialised{});
    for (std::size_t i = 0; i < result.part_.size(); ++i) result.part_[i] = f(a.part_[i]);
    return result;
  }
  template <class F>
  UPRIGHT_LANES_INLINE static Lanes map(const Lanes& a, const Lanes& b, F&& f) {
    Lanes result(uninitialised{});
    for (std::size_t i = 0; i < result.part_.size(); ++i) result.part_[i] = f(a.part_[i], b.part_[i]);
    return result;
  }
  template <class F>
  UPRIGHT_LANES_INLINE static LaneMask compare(const Lanes& a, const Lanes& b, F&& f) {
    LaneMask result;
    for (std::size_t i = 0; i < result.part.size(); ++i) result.part[i] = f(a.part_[i], b.part_[i]);
    return result;
  }

  Parts part_;
};

}  // namespace upright

#undef UPRIGHT_LANES_INLINE
