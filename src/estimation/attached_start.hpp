// Where a sprung mass is at the start of a segment. The motion of the cart was measured and drives it, so
// nothing of this start is free. Were it, a mass that rings anew in each segment would account for any
// disturbance near its frequency.
#pragma once

#include <cstddef>

#include "segments.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"
#include "upright/model/plant_state.hpp"

namespace upright {

/// Whether a plant has a mass of which the cart's motion says where it is: one on the cart. The motor behind
/// its backlash is moved by its own force as well. A rod bends by less than most sensors of the angle show.
bool is_driven_by_cart(const Plant& plant);
/// Whether the mass that an effect attaches is one.
bool is_driven_by_cart(std::size_t effect);

/// The measured motion of the cart before a segment: it says where such a mass is at the start.
class MotionBefore {
 public:
  /// Keeps a reference to the run.
  MotionBefore(const Measurement& run, const Segment& segment);

  /// Whether it is known for long enough. Soon after missing rows, or after the beginning of a run in motion,
  /// it is not: then the start of the mass is free.
  bool is_known() const { return is_known_; }
  /// Whether there is none: then the mass is at rest on the cart. Otherwise it falls behind by as much as the
  /// cart's own start is further.
  bool is_empty() const { return begin_ == end_; }
  /// A start with the mass of a plant where it is if all other states are these; unchanged where it is free.
  PlantState<double> with_mass(const Plant& plant, PlantState<double> start) const;

 private:
  const Measurement& run_;
  std::size_t begin_, end_;
  bool is_known_ = true;
};

}  // namespace upright
