// Where a sprung mass is at the start of a segment. The motion of the cart was measured and drives it, so
// nothing of this start is free. Were it, a mass that rings anew in each segment would account for any
// disturbance near its frequency.
#pragma once

#include <optional>

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

/// The state of such a mass at the start of a segment.
struct AttachedStart {
  double attached_m = 0.0, attached_mps = 0.0;  ///< as in PlantState
  /// Whether it follows from a motion before the segment. Then it falls behind by as much as the cart's own
  /// start is further. Otherwise it is at rest on the cart.
  bool is_moved = false;
};

/// Of the mass of a plant in a segment where all other states are these. Nothing soon after missing rows, or
/// after the beginning of a run in motion: then the start is free.
std::optional<AttachedStart> attached_start(const Measurement& run, const Segment& segment,
                                            const Plant& plant, const PlantState<double>& start);

/// A start with the mass where it is then; unchanged where it is free.
PlantState<double> with_attached_start(const Measurement& run, const Segment& segment, const Plant& plant,
                                       PlantState<double> start);

}  // namespace upright
