// The direction of a motion and the time since its last reversal.
#pragma once

#include <cmath>

namespace upright {

/// -1, 0 or 1; 0 within the dead band.
inline double direction_of(double v, double dead) {
  return v > dead ? 1.0 : v < -dead ? -1.0 : 0.0;
}

struct Reversal {
  double since_s = 0.0, last = 0.0;
  void pass(double now, double dt) {
    since_s += dt;
    if (now == 0.0) return;
    if (now != last) since_s = 0.0;
    last = now;
  }
  /// The direction, with a magnitude that decays after a reversal. 0 before the first one.
  double fading(double over_s) const { return std::exp(-since_s / over_s) * last; }
};

}  // namespace upright
