// lost_counts: the counter of the cart's encoder loses counts while the cart is fast.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// The counter of the cart's encoder loses counts while the cart is faster than a speed. A counter that stays
/// at its fastest rate has the share 1. A program that polls both channels, and takes a jump over two counts
/// for none, has the share 2. Lost counts do not come back, so the zero of the position moves. The position x
/// of the plant is the one that the counter shows: a force that depends on the place, and the ends of the
/// track, move along with the zero.
struct LostCounts {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"share", "1", (Range{0.0, 3.0}), 0.0, 1.0, "s: of each count beyond that speed, how many are lost"},
      {"speed_mps", "m/s", Range::positive(), no_neutral, 0.5, "v1: of the cart, at which the loss sets in"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "lost_counts",
      Enters::sensor,
      false,
      "dx/dt = v - s sign(v) max(|v| - v1, 0), rounded within a tenth of v1; x as the counter shows it",
      "the counter of the cart's encoder loses counts while the cart is fast",
      parameters};

  /// Velocity that is lost of a velocity v [m/s].
  template <class S>
  static S lost_mps(const S* p, const S& v) {
    const S direction = select(v < S(0.0), S(-1.0), S(1.0)), width_mps = onset * p[1];
    const S u = (direction * v - p[1]) / width_mps, t = positive_part(S(u + 1.0));
    return p[0] * direction * width_mps * select(u < S(1.0), S(t * t * t * (3.0 - u) / 16.0), u);
  }

 private:
  /// The loss sets in between 0.9 and 1.1 v1, since such a program is not punctual. Its second derivative has
  /// no jump there, which the steps of the engines need.
  static constexpr double onset = 0.1;
};

}  // namespace upright::effects
