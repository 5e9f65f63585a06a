// The positions and texts of the ticks of an axis.
#pragma once

#include <string>
#include <vector>

namespace upright {

struct Tick {
  double at = 0.0;
  std::string text;
};

/// The range of an axis and its space on the page.
struct AxisSpan {
  double low = 0.0, high = 1.0;
  bool logarithmic = false;
  bool whole = false;  ///< counts: no tick between two whole numbers
  double length_px = 400.0;
  bool horizontal = true;  ///< texts stand beside each other, not above
  double text_px = 12.0;
};

/// Width of a text in a plot [px], a little more than it needs.
double text_width_px(const std::string& text, double text_px);

/// At steps of 1, 2 or 5 times a power of ten, as close as their texts have room. A logarithmic axis has
/// ticks in each decade where there is room, and those of a linear one where it spans less than one decade.
std::vector<Tick> ticks_of(const AxisSpan& axis);

}  // namespace upright
