// Taylor series in time of the motion in each lane, as a scalar for the generic physics. A series is known up
// to the degree to which the motion that enters it is known; each evaluation of the physics gives the next
// coefficient of the motion.
//
// The value at the beginning of a step is in double precision, the coefficients of time in single precision:
// in a step of a millisecond they move a velocity by some hundredth of itself, those beyond the acceleration,
// which is a value, by less than a thousandth. So an error of 6e-8 of them is one of some 1e-10 per step, and
// one register has what takes two in double precision.
#pragma once

#include <array>

#include "lane_model.hpp"
#include "upright/model/elementary.hpp"

#define UPRIGHT_SERIES_INLINE [[gnu::always_inline]] inline

namespace upright {

/// One number for each run, in single precision: in one register.
class CoarseLanes {
 public:
  using Batch = xsimd::batch<float>;
  using Mask = xsimd::batch_bool<float>;
  static_assert(Batch::size == lane_count);

  CoarseLanes() : CoarseLanes(0.0f) {}
  UPRIGHT_SERIES_INLINE explicit CoarseLanes(float everywhere) : of_(everywhere) {}
  UPRIGHT_SERIES_INLINE explicit CoarseLanes(const Lanes& lanes) : of_(narrowed(lanes.parts())) {}
  UPRIGHT_SERIES_INLINE Lanes widened() const {
#if defined(__AVX512F__)
    return Lanes(
        {_mm512_cvtps_pd(_mm512_castps512_ps256(of_)), _mm512_cvtps_pd(_mm512_extractf32x8_ps(of_, 1))});
#elif defined(__AVX__)
    return Lanes(
        {_mm256_cvtps_pd(_mm256_castps256_ps128(of_)), _mm256_cvtps_pd(_mm256_extractf128_ps(of_, 1))});
#elif defined(__SSE2__)
    return Lanes({_mm_cvtps_pd(of_), _mm_cvtps_pd(_mm_movehl_ps(of_, of_))});
#else
    std::array<float, lane_count> numbers;
    of_.store_unaligned(numbers.data());
    std::array<double, lane_count> wide;
    std::copy(numbers.begin(), numbers.end(), wide.begin());
    return Lanes::load(wide.data());
#endif
  }

  UPRIGHT_SERIES_INLINE friend CoarseLanes operator+(const CoarseLanes& a, const CoarseLanes& b) {
    return CoarseLanes(a.of_ + b.of_);
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes operator-(const CoarseLanes& a, const CoarseLanes& b) {
    return CoarseLanes(a.of_ - b.of_);
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes operator*(const CoarseLanes& a, const CoarseLanes& b) {
    return CoarseLanes(a.of_ * b.of_);
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes operator*(float a, const CoarseLanes& b) {
    return CoarseLanes(a) * b;
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes operator-(const CoarseLanes& a) {
    return CoarseLanes(-a.of_);
  }

  UPRIGHT_SERIES_INLINE friend CoarseLanes absolute(const CoarseLanes& a) {
    return CoarseLanes(xsimd::abs(a.of_));
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes sqrt(const CoarseLanes& a) {
    return CoarseLanes(xsimd::sqrt(a.of_));
  }
  /// 1 / a and the square root of a > 0, exact to 1e-4 at least: for guesses that are improved.
  UPRIGHT_SERIES_INLINE friend CoarseLanes rough_inverse(const CoarseLanes& a) {
#if defined(__AVX512F__)
    return CoarseLanes(Batch(_mm512_rcp14_ps(a.of_)));
#else
    return CoarseLanes(Batch(1.0f) / a.of_);
#endif
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes rough_sqrt(const CoarseLanes& a) {
#if defined(__AVX512F__)
    return CoarseLanes(a.of_ * Batch(_mm512_rsqrt14_ps(a.of_)));
#else
    return CoarseLanes(xsimd::sqrt(a.of_));
#endif
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes smaller(const CoarseLanes& a, const CoarseLanes& b) {
    return CoarseLanes(xsimd::min(a.of_, b.of_));
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes larger(const CoarseLanes& a, const CoarseLanes& b) {
    return CoarseLanes(xsimd::max(a.of_, b.of_));
  }
  UPRIGHT_SERIES_INLINE friend Mask operator<(const CoarseLanes& a, const CoarseLanes& b) {
    return a.of_ < b.of_;
  }
  UPRIGHT_SERIES_INLINE friend CoarseLanes select(const Mask& condition, const CoarseLanes& yes,
                                                  const CoarseLanes& no) {
    return CoarseLanes(xsimd::select(condition, yes.of_, no.of_));
  }
  /// The same mask for numbers in single precision.
  UPRIGHT_SERIES_INLINE static Mask narrowed(const LaneMask& mask) {
#if defined(__AVX512F__)
    return Mask(_mm512_kunpackb(mask.part[1].data, mask.part[0].data));
#elif defined(__AVX2__)
    constexpr int evens = 0x88, middle_swapped = 0xd8;
    return Mask(_mm256_castpd_ps(
        _mm256_permute4x64_pd(_mm256_castps_pd(_mm256_shuffle_ps(_mm256_castpd_ps(mask.part[0]),
                                                                 _mm256_castpd_ps(mask.part[1]), evens)),
                              middle_swapped)));
#elif defined(__SSE2__)
    constexpr int evens = 0x88;
    return Mask(_mm_shuffle_ps(_mm_castpd_ps(mask.part[0]), _mm_castpd_ps(mask.part[1]), evens));
#else
    return CoarseLanes(0.0f) < CoarseLanes(select(mask, Lanes(1.0), Lanes(0.0)));
#endif
  }

 private:
  UPRIGHT_SERIES_INLINE explicit CoarseLanes(const Batch& of) : of_(of) {}
  UPRIGHT_SERIES_INLINE static Batch narrowed(const Lanes::Parts& parts) {
    static_assert(lanes_detail::parts == 2);
#if defined(__AVX512F__)
    return _mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps(parts[0])), _mm512_cvtpd_ps(parts[1]),
                              1);
#elif defined(__AVX__)
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm256_cvtpd_ps(parts[0])), _mm256_cvtpd_ps(parts[1]),
                                1);
#elif defined(__SSE2__)
    return _mm_movelh_ps(_mm_cvtpd_ps(parts[0]), _mm_cvtpd_ps(parts[1]));
#else
    std::array<double, lane_count> wide;
    Lanes(parts).store(wide.data());
    std::array<float, lane_count> numbers;
    std::copy(wide.begin(), wide.end(), numbers.begin());
    return Batch::load_unaligned(numbers.data());
#endif
  }

  Batch of_;
};

/// A number of a plant whose motion is a series, with what series need of it.
struct LaneConstant : Lanes {
  UPRIGHT_SERIES_INLINE LaneConstant() : LaneConstant(Lanes(0.0)) {}
  UPRIGHT_SERIES_INLINE LaneConstant(double number) : LaneConstant(Lanes(number)) {}  // NOLINT: as Lanes do
  UPRIGHT_SERIES_INLINE LaneConstant(const Lanes& of)  // NOLINT: a number of lanes
      : Lanes(of), coarse(of), per(inverse(of)), coarse_per(per) {}

  CoarseLanes coarse;
  Lanes per;  ///< its inverse
  CoarseLanes coarse_per;

  UPRIGHT_SERIES_INLINE friend LaneConstant operator-(const LaneConstant& a) {
    LaneConstant result = a;
    static_cast<Lanes&>(result) = -static_cast<const Lanes&>(a);
    result.coarse = -a.coarse;
    result.per = -a.per;
    result.coarse_per = -a.coarse_per;
    return result;
  }
};

/// The inverse is found once.
template <>
class Divisor<LaneConstant> {
 public:
  explicit Divisor(const LaneConstant& value) : inverse_(inverse(value)) {}
  template <class T>
  UPRIGHT_SERIES_INLINE friend T operator/(const T& dividend, const Divisor& by) {
    return by.inverse_ * dividend;
  }

 private:
  LaneConstant inverse_;
};

/// value + more[0] t + more[1] t^2 + ... up to the degree. The value is kept in both precisions.
template <int degree>
struct LaneSeries {
  static_assert(degree >= 0 && degree <= 3);

  UPRIGHT_SERIES_INLINE LaneSeries() = default;
  UPRIGHT_SERIES_INLINE explicit LaneSeries(double constant)
      : value(constant), coarse(static_cast<float>(constant)) {}
  UPRIGHT_SERIES_INLINE explicit LaneSeries(const Lanes& constant) : value(constant), coarse(constant) {}
  UPRIGHT_SERIES_INLINE LaneSeries(const LaneConstant& constant)  // NOLINT: constants mix with series
      : value(constant), coarse(constant.coarse) {}
  UPRIGHT_SERIES_INLINE LaneSeries(const Lanes& of, const CoarseLanes& coarse_of)
      : value(of), coarse(coarse_of) {}

  Lanes value;
  CoarseLanes coarse;
  std::array<CoarseLanes, degree> more;

  UPRIGHT_SERIES_INLINE friend LaneSeries operator+(const LaneSeries& a, const LaneSeries& b) {
    LaneSeries sum(a.value + b.value, a.coarse + b.coarse);
    for_each_power([&]<int k>() { sum.template at<k>() = a.template at<k>() + b.template at<k>(); });
    return sum;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries operator-(const LaneSeries& a, const LaneSeries& b) {
    LaneSeries difference(a.value - b.value, a.coarse - b.coarse);
    for_each_power([&]<int k>() { difference.template at<k>() = a.template at<k>() - b.template at<k>(); });
    return difference;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries operator-(const LaneConstant& a, const LaneSeries& b) {
    LaneSeries difference(a - b.value, a.coarse - b.coarse);
    for_each_power([&]<int k>() { difference.template at<k>() = -b.template at<k>(); });
    return difference;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries operator-(const LaneSeries& a) {
    LaneSeries result(-a.value, -a.coarse);
    for_each_power([&]<int k>() { result.template at<k>() = -a.template at<k>(); });
    return result;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries operator*(const LaneConstant& a, const LaneSeries& b) {
    LaneSeries product(a * b.value, a.coarse * b.coarse);
    for_each_power([&]<int k>() { product.template at<k>() = a.coarse * b.template at<k>(); });
    return product;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries operator/(const LaneSeries& a, const LaneConstant& b) {
    LaneSeries quotient(a.value * b.per, a.coarse * b.coarse_per);
    for_each_power([&]<int k>() { quotient.template at<k>() = a.template at<k>() * b.coarse_per; });
    return quotient;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries operator*(const LaneSeries& a, const LaneSeries& b) {
    LaneSeries product(a.value * b.value, a.coarse * b.coarse);
    if constexpr (degree >= 1) product.more[0] = a.coarse * b.more[0] + a.more[0] * b.coarse;
    if constexpr (degree >= 2)
      product.more[1] = a.coarse * b.more[1] + a.more[0] * b.more[0] + a.more[1] * b.coarse;
    if constexpr (degree >= 3)
      product.more[2] =
          a.coarse * b.more[2] + a.more[0] * b.more[1] + a.more[1] * b.more[0] + a.more[2] * b.coarse;
    return product;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries operator/(const LaneSeries& a, const LaneSeries& b) {
    const Lanes per = inverse(b.value);
    LaneSeries q(a.value * per);
    const CoarseLanes coarse_per(per);
    if constexpr (degree >= 1) q.more[0] = (a.more[0] - b.more[0] * q.coarse) * coarse_per;
    if constexpr (degree >= 2)
      q.more[1] = (a.more[1] - b.more[0] * q.more[0] - b.more[1] * q.coarse) * coarse_per;
    if constexpr (degree >= 3)
      q.more[2] =
          (a.more[2] - b.more[0] * q.more[1] - b.more[1] * q.more[0] - b.more[2] * q.coarse) * coarse_per;
    return q;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries exp(const LaneSeries& x) {
    LaneSeries e(exp(x.value));
    if constexpr (degree >= 1) e.more[0] = x.more[0] * e.coarse;
    if constexpr (degree >= 2) e.more[1] = x.more[1] * e.coarse + 0.5f * x.more[0] * e.more[0];
    if constexpr (degree >= 3)
      e.more[2] =
          x.more[2] * e.coarse + (1.0f / 3.0f) * (2.0f * x.more[1] * e.more[0] + x.more[0] * e.more[1]);
    return e;
  }
  UPRIGHT_SERIES_INLINE friend LaneSeries select(const LaneMask& condition, const LaneSeries& yes,
                                                 const LaneSeries& no) {
    const CoarseLanes::Mask coarse_condition = CoarseLanes::narrowed(condition);
    LaneSeries result(select(condition, yes.value, no.value),
                      select(coarse_condition, yes.coarse, no.coarse));
    for_each_power([&]<int k>() {
      result.template at<k>() = select(coarse_condition, yes.template at<k>(), no.template at<k>());
    });
    return result;
  }
  /// Speeds and levels of friction, which are not negative where a step begins, are continued as they are.
  UPRIGHT_SERIES_INLINE friend LaneSeries positive_part(const LaneSeries& x) { return x; }

  /// The coefficient of t^k.
  template <int k>
  UPRIGHT_SERIES_INLINE CoarseLanes& at() {
    return more[k - 1];
  }
  template <int k>
  UPRIGHT_SERIES_INLINE const CoarseLanes& at() const {
    return more[k - 1];
  }

 private:
  template <class F>
  UPRIGHT_SERIES_INLINE static void for_each_power(const F& f) {
    if constexpr (degree >= 1) f.template operator()<1>();
    if constexpr (degree >= 2) f.template operator()<2>();
    if constexpr (degree >= 3) f.template operator()<3>();
  }
};

/// The same series and one coefficient more.
template <int known>
UPRIGHT_SERIES_INLINE LaneSeries<known + 1> longer(const LaneSeries<known>& of, const CoarseLanes& next) {
  LaneSeries<known + 1> result(of.value, of.coarse);
  if constexpr (known >= 1) result.more[0] = of.more[0];
  if constexpr (known >= 2) result.more[1] = of.more[1];
  result.more[known] = next;
  return result;
}

/// The integral of a rate from this value.
template <int known>
UPRIGHT_SERIES_INLINE LaneSeries<known + 1> integral(const LaneSeries<known>& of,
                                                     const LaneSeries<known>& rate) {
  if constexpr (known == 0)
    return longer(of, rate.coarse);
  else
    return longer(of, 1.0f / static_cast<float>(known + 1) * rate.more[known - 1]);
}

/// Sine and cosine of an angle that is known to one degree more.
template <int known>
UPRIGHT_SERIES_INLINE elementary::SineAndCosine<LaneSeries<known + 1>> longer(
    const elementary::SineAndCosine<LaneSeries<known>>& of, const LaneSeries<known + 1>& angle) {
  const auto& [s, c] = of;
  CoarseLanes s_slope = angle.more[known], c_slope = angle.more[known];
  if constexpr (known == 0) {
    s_slope = s_slope * c.coarse;
    c_slope = c_slope * s.coarse;
  } else {
    const auto weight = [](int k) { return static_cast<float>(k) / static_cast<float>(known + 1); };
    s_slope = s_slope * c.coarse + weight(1) * angle.more[0] * c.more[known - 1];
    c_slope = c_slope * s.coarse + weight(1) * angle.more[0] * s.more[known - 1];
    if constexpr (known == 2) {
      s_slope = s_slope + weight(2) * angle.more[1] * c.more[0];
      c_slope = c_slope + weight(2) * angle.more[1] * s.more[0];
    }
  }
  return {longer(s, s_slope), longer(c, -c_slope)};
}

}  // namespace upright

#undef UPRIGHT_SERIES_INLINE
