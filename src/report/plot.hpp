// A plot as plain data, and its drawing as an SVG element by gnuplot.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/palette.hpp"

namespace upright {

struct Axis {
  std::string label;  ///< with its unit: "cart position [m]"
  bool logarithmic = false;
  std::optional<double> low;  ///< not given: from the data
  std::optional<double> high;
  bool whole = false;  ///< counts: no tick between two whole numbers
};

/// Points joined in their order. A value that is not finite leaves a gap.
struct Series {
  enum class Style { line, steps, points, bars };
  std::string name;  ///< in the key; empty: not in the key
  std::vector<double> x;
  std::vector<double> y;  ///< as many as x
  Style style = Style::line;
  std::string_view color = {};  ///< of the palette; empty: the next of color::curve
  bool dashed = false;
};

/// A region between two curves, drawn light behind the series.
struct Band {
  std::string name;
  std::vector<double> x;
  std::vector<double> low;
  std::vector<double> high;
};

/// Values on a rectangular grid; cell (row, column) is centred at (x[column], y[row]).
struct HeatMap {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> values;  ///< row by row, y.size() rows of x.size(); not finite: left blank
  std::string label;           ///< of the colour scale
  /// For outcomes instead of magnitudes: value k is `classes[k]`, in the colour that it has everywhere.
  std::vector<std::string> classes;
  bool light = false;  ///< of magnitudes: pale colours, on which the lines of all series are visible
};

/// A straight line across the plot at one place, with a label.
struct Mark {
  double at = 0.0;
  std::string label;
};

struct Plot {
  std::string title;
  Axis x;
  Axis y;
  std::vector<Series> series;
  std::vector<Band> bands;
  std::optional<HeatMap> heat_map;
  std::vector<Mark> vertical_marks;
  std::vector<Mark> horizontal_marks;
  std::string link;  ///< the file that the title links to, relative to the page
  int width_px = 900;
  int height_px = 260;
  int text_px = 12;
  /// Room for the vertical axis; plots above each other share the largest, so that their axes align.
  std::optional<int> left_px;
};

/// The entries of the key beside the drawing: what the curves and colours mean.
struct KeyEntry {
  enum class Swatch { line, dashed, point, area };
  std::string name;
  std::string_view color;
  Swatch swatch = Swatch::line;
};
std::vector<KeyEntry> key_of(const Plot& plot);

/// The room that the texts of the vertical axis need.
int left_px_of(const Plot& plot);

/// Gives plots that stand above each other the same horizontal range at the same place.
void align(std::vector<Plot>& plots);

/// Draws the plot without its title and key: one `<svg>` element that refers to nothing outside itself and
/// whose identifiers begin with `id` (letters and digits; unique within a page). Text is shown as given,
/// never interpreted. Long lines are thinned to the smallest and largest value of each pixel column, so no
/// peak is lost. Throws Error when gnuplot is missing or fails, and when x and y of a series differ in
/// length.
std::string svg_of(const Plot& plot, const std::string& id);

/// The same with title and key as a file of its own, which a browser shows and a Markdown page includes.
std::string svg_file_of(const Plot& plot);

/// Thins a line to at most about two points per column over `columns` columns; keeps each column's extremes.
/// x must not decrease. Returned as indices into x and y. Values that are not finite are kept as gaps.
std::vector<std::size_t> thinned(const std::vector<double>& x, const std::vector<double>& y,
                                 std::size_t columns);

/// A histogram of finite values, each with how often it came, as bars over `bins` equal bins.
Series histogram(const std::vector<std::pair<double, std::uint64_t>>& values, std::size_t bins,
                 const std::string& name);

}  // namespace upright
