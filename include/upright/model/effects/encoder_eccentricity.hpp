// encoder_eccentricity: the pinion of the cart's encoder runs out of true.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/elementary.hpp"

namespace upright::effects {

/// The pinion of the cart's encoder runs out of true: at some of its angles it turns further per metre than
/// at others. The share is its eccentricity divided by its radius, the pitch its circumference.
struct EncoderEccentricity {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"share", "1", (Range{0.0, 0.5}), 0.0, 0.01,
       "e: largest change of what is shown per metre, as a share"},
      {"pitch_m", "m", Range::positive(), no_neutral, 0.1, "p: travel of the cart per turn of the pinion"},
      {"phase_rad", "rad", Range::any(), no_neutral, 0.0, "phase at x = 0"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "encoder_eccentricity",
      Enters::sensor,
      false,
      "measured x = x + e p/(2 pi) (sin(2 pi x / p + phase) - sin(phase))",
      "the pinion of the cart's encoder runs out of true, so the encoder errs once per turn",
      parameters};

  /// What the encoder shows too much [m]. Its zero is at x = 0.
  template <class S>
  static S encoder_error_m(const S* p, const S& x) {
    const S radius_m = p[1] / S(two_pi);
    return p[0] * radius_m * (elementary::sin(S(x / radius_m + p[2])) - elementary::sin(p[2]));
  }

 private:
  static constexpr double two_pi = 6.283185307179586;
};

}  // namespace upright::effects
