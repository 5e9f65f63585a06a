#include "plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>

#include "gnuplot.hpp"
#include "ticks.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

// Room around the axes, in heights of a text: half a tick's text at the right; ticks and label below; the
// scale of a heat map of magnitudes; at least so much at the left, so that most plots of a page align.
constexpr double line_heights = 1.5, right_heights = 2.0, bottom_heights = 4.0, scale_heights = 8.5,
                 min_left_heights = 6.0;

int heights(const Plot& plot, double count) {
  return static_cast<int>(count * plot.text_px);
}

/// Text in gnuplot's single quotes. Characters with a meaning in gnuplot, in SVG or in `as_element` below are
/// written as numeric character references, which gnuplot passes through.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (std::string_view("&<>'\"#").find(c) != std::string_view::npos)
      result += "&#x" + std::string(1, "0123456789abcdef"[code / 16]) + "0123456789abcdef"[code % 16] + ";";
    else
      result += code < 0x20 || code == 0x7f ? ' ' : c;
  }
  return result + "'";
}

std::string quoted_color(std::string_view color) {
  return "'" + std::string(color) + "'";
}

void require(bool good, const std::string& what) {
  if (!good) throw Error(ExitCode::usage, "internal error: a plot's " + what + ": report this as a bug");
}

/// gnuplot's arithmetic overflows near the ends of a double's range. No plotted quantity is so large.
constexpr double largest_drawn = 1e100;

bool drawable(double value, const Axis& axis) {
  return std::abs(value) <= largest_drawn && (!axis.logarithmic || value >= 1.0 / largest_drawn);
}

std::string row(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += exact_text(value) + " ";
  text.back() = '\n';
  return text;
}

/// The finite range of what is drawn along one axis.
struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void include(const std::vector<double>& values, const Axis& axis) {
    for (const double value : values) {
      if (!drawable(value, axis)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
};

constexpr std::size_t few_points = 2000;

/// The first of the points in each pixel, since the others are not visible.
std::vector<std::size_t> seen_points(const Series& series, const Plot& plot) {
  Extent x, y;
  x.include(series.x, plot.x);
  y.include(series.y, plot.y);
  const auto cell = [](double value, const Axis& axis, const Extent& extent, int pixels) {
    const auto on = [&](double v) { return axis.logarithmic ? std::log(v) : v; };
    const double span = on(extent.high) - on(extent.low);
    return span > 0.0 ? static_cast<int>(pixels * (on(value) - on(extent.low)) / span) : 0;
  };
  std::set<std::pair<int, int>> taken;
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < series.x.size(); ++i)
    if (drawable(series.x[i], plot.x) && drawable(series.y[i], plot.y) &&
        taken
            .emplace(cell(series.x[i], plot.x, x, plot.width_px),
                     cell(series.y[i], plot.y, y, plot.height_px))
            .second)
      seen.push_back(i);
  return seen;
}

std::string line_data(const Series& series, const Plot& plot) {
  std::string text;
  const auto append = [&](std::size_t i) {
    const bool good = drawable(series.x[i], plot.x) && drawable(series.y[i], plot.y);
    text += good ? row({series.x[i], series.y[i]}) : "\n";  // an empty line breaks the line
  };
  const bool joined = series.style == Series::Style::line || series.style == Series::Style::steps;
  if (joined && std::is_sorted(series.x.begin(), series.x.end())) {
    for (const std::size_t i : thinned(series.x, series.y, static_cast<std::size_t>(plot.width_px)))
      append(i);
  } else if (series.style == Series::Style::points && series.x.size() > few_points) {
    for (const std::size_t i : seen_points(series, plot)) append(i);
  } else {
    for (std::size_t i = 0; i < series.x.size(); ++i) append(i);
  }
  return text;
}

/// The curves of a plot: their data blocks, and the plot command.
struct Curves {
  std::string blocks;
  std::string commands;

  void add(const std::string& data, const std::string& how, const std::string& name) {
    if (data.find_first_not_of('\n') == std::string::npos) return;
    const std::string block = "$d" + std::to_string(count_++);
    blocks += block + " << UPRIGHT_END\n" + data + "UPRIGHT_END\n";
    commands += (commands.empty() ? "plot " : ", \\\n  ") + block + " " + how +
                (name.empty() ? " notitle" : " title " + quoted(name));
  }

 private:
  int count_ = 0;
};

void add_bands(const Plot& plot, Curves& curves) {
  for (const Band& band : plot.bands) {
    require(band.x.size() == band.low.size() && band.x.size() == band.high.size(),
            "band has unequal lengths");
    std::string data;
    for (std::size_t i = 0; i < band.x.size(); ++i)
      data += drawable(band.low[i], plot.y) && drawable(band.high[i], plot.y)
                  ? row({band.x[i], band.low[i], band.high[i]})
                  : "\n";
    curves.add(data, "using 1:2:3 with filledcurves lc rgb " + quoted_color(color::band), band.name);
  }
}

/// The colours of the series. On a heat map only dark ink is visible everywhere.
std::vector<std::string_view> colors_of(const Plot& plot) {
  std::vector<std::string_view> colors;
  std::size_t next = 0;
  for (const Series& series : plot.series)
    colors.push_back(plot.heat_map ? color::ink : series.color.empty() ? color::curve(next++) : series.color);
  return colors;
}

void add_series(const Plot& plot, Curves& curves) {
  const std::vector<std::string_view> colors = colors_of(plot);
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const Series& series = plot.series[k];
    require(series.x.size() == series.y.size(), "series has unequal lengths");
    const std::string color = " lc rgb " + quoted_color(colors[k]);
    const std::string line = color + " lw 1.4" + (series.dashed ? " dt 2" : "");
    std::string how;
    switch (series.style) {
      case Series::Style::line:
        how = "with lines" + line;
        break;
      case Series::Style::steps:
        how = "with steps" + line;
        break;
      case Series::Style::points:
        // Few points are drawn large, many as a cloud.
        how = std::string("with points pt 7 ps ") + (series.x.size() < 200 ? "0.8" : "0.35") + color;
        break;
      case Series::Style::bars:
        how = "with boxes fs solid 1.0 noborder" + color;
        break;
    }
    curves.add(line_data(series, plot), how, series.name);
  }
}

/// The edges between cell centres; the outer cells are as wide as their neighbours. With a logarithmic axis
/// the middle is the geometric one, and no edge lies where nothing is drawn.
std::vector<double> edges_of(const std::vector<double>& centres, const Axis& axis) {
  const auto to = [&](double v) { return axis.logarithmic ? std::log(v) : v; };
  const double farthest = std::log(largest_drawn);
  const auto from = [&](double v) {
    return axis.logarithmic ? std::exp(std::clamp(v, -farthest, farthest)) : v;
  };
  std::vector<double> edges;
  if (centres.size() == 1) {
    const double half = axis.logarithmic ? 0.1 : std::max(0.5 * std::abs(centres[0]), 1e-9);
    return {from(to(centres[0]) - half), from(to(centres[0]) + half)};
  }
  edges.push_back(from(1.5 * to(centres[0]) - 0.5 * to(centres[1])));
  for (std::size_t i = 1; i < centres.size(); ++i)
    edges.push_back(from(0.5 * (to(centres[i - 1]) + to(centres[i]))));
  const std::size_t n = centres.size();
  edges.push_back(from(1.5 * to(centres[n - 1]) - 0.5 * to(centres[n - 2])));
  return edges;
}

/// Rows of equal neighbouring cells merged into one rectangle: outcome maps shrink a hundredfold.
std::string cells_data(const HeatMap& map, const Plot& plot) {
  const std::vector<double> x_edges = edges_of(map.x, plot.x);
  const std::vector<double> y_edges = edges_of(map.y, plot.y);
  std::string text;
  for (std::size_t r = 0; r < map.y.size(); ++r) {
    for (std::size_t begin = 0; begin < map.x.size();) {
      const double value = map.values[r * map.x.size() + begin];
      std::size_t end = begin + 1;
      while (end < map.x.size() && map.values[r * map.x.size() + end] == value) ++end;
      if (std::isfinite(value))
        text += row({0.5 * (x_edges[begin] + x_edges[end]), 0.5 * (y_edges[r] + y_edges[r + 1]),
                     x_edges[begin], x_edges[end], y_edges[r], y_edges[r + 1], value});
      begin = end;
    }
  }
  return text;
}

std::string color_scale(const HeatMap& map) {
  const std::string end = map.light ? "" : ", 0.7 '#1f618d', 1 '#0b2545'";
  if (map.classes.empty())
    return "set palette defined (0 '#f4f8fb', 0.35 '#7fb3d5'" + end + ")\nset cblabel " + quoted(map.label) +
           "\n";
  std::string text = "set palette maxcolors " + std::to_string(map.classes.size()) + " defined (";
  for (std::size_t k = 0; k < map.classes.size(); ++k)
    text += (k == 0 ? "" : ", ") + std::to_string(k) + " " + quoted_color(color::of_outcome(map.classes[k]));
  if (map.classes.size() == 1) text += ", 1 " + quoted_color(color::of_outcome(map.classes[0]));
  return text + ")\nset cbrange [-0.5:" + exact_text(static_cast<double>(map.classes.size()) - 0.5) +
         "]\nunset colorbox\n";
}

void add_heat_map(const Plot& plot, Curves& curves, std::string& settings) {
  if (!plot.heat_map) return;
  const HeatMap& map = *plot.heat_map;
  require(!map.x.empty() && !map.y.empty() && map.values.size() == map.x.size() * map.y.size(),
          "heat map has the wrong number of values");
  settings += color_scale(map) + "set tics front\n";
  curves.add(cells_data(map, plot), "using 1:2:3:4:5:6:7 with boxxyerror fs solid noborder fc palette", "");
}

struct AxisRange {
  double low = 0.0, high = 1.0;
};

/// A range for an axis with a small margin. gnuplot rejects an empty range and rounds automatic ones.
AxisRange range_of(const Axis& axis, const Extent& extent, double margin) {
  double low = axis.low.value_or(extent.low);
  double high = axis.high.value_or(extent.high);
  if (!(low <= high)) {
    low = axis.logarithmic ? 1.0 : 0.0;
    high = axis.logarithmic ? 10.0 : 1.0;
  }
  if (axis.logarithmic) {
    const double room = std::max(std::pow(high / low, margin), margin > 0.0 || low == high ? 1.05 : 1.0);
    if (!axis.low) low /= room;
    if (!axis.high) high *= room;
    if (low == high) high = 1.05 * low;
  } else {
    double room = margin * (high - low);
    if (high - low <= 1e-12 * std::max(std::abs(low), std::abs(high)) || high == low)
      room = std::max(0.1 * std::abs(high), 1e-6);
    if (!axis.low) low -= room;
    if (!axis.high) high += room;
    if (low == high) high = low + std::max(0.1 * std::abs(low), 1e-6);
  }
  return {low, high};
}

struct AxisRanges {
  AxisRange x, y;
};

AxisRanges ranges_of(const Plot& plot) {
  if (plot.heat_map) {
    const std::vector<double> x_edges = edges_of(plot.heat_map->x, plot.x);
    const std::vector<double> y_edges = edges_of(plot.heat_map->y, plot.y);
    return {{plot.x.low.value_or(x_edges.front()), plot.x.high.value_or(x_edges.back())},
            {plot.y.low.value_or(y_edges.front()), plot.y.high.value_or(y_edges.back())}};
  }
  Extent x;
  Extent y;
  bool bars = false;
  bool room_beside = false;  // bars have a width, and a curve that turns back should not run along the frame
  for (const Series& series : plot.series) {
    x.include(series.x, plot.x);
    y.include(series.y, plot.y);
    bars = bars || series.style == Series::Style::bars;
    room_beside = room_beside || bars || !std::is_sorted(series.x.begin(), series.x.end());
  }
  for (const Band& band : plot.bands) {
    x.include(band.x, plot.x);
    y.include(band.low, plot.y);
    y.include(band.high, plot.y);
  }
  Axis y_axis = plot.y;
  if (bars && !y_axis.low && !y_axis.logarithmic) y_axis.low = 0.0;
  return {range_of(plot.x, x, room_beside ? 0.03 : 0.0), range_of(y_axis, y, 0.06)};
}

std::vector<const Mark*> drawn_marks(const Plot& plot) {
  std::vector<const Mark*> marks;
  for (const Mark& mark : plot.vertical_marks)
    if (drawable(mark.at, plot.x)) marks.push_back(&mark);
  return marks;
}

/// Room around the axes of a drawing [px].
struct Margins {
  int left = 0, right = 0, top = 0, bottom = 0;
};

/// The key's lines in a drawing that has it inside.
int key_lines(const Plot& plot) {
  const std::vector<KeyEntry> key = key_of(plot);
  const double swatch_px = 5.0 * plot.text_px;  // gnuplot's sample and the room around it
  double widest = 0.0;
  for (const KeyEntry& entry : key)
    widest = std::max(widest, text_width_px(entry.name, plot.text_px) + swatch_px);
  const double room = plot.width_px - heights(plot, min_left_heights + right_heights);
  const int columns = std::max(1, static_cast<int>(room / std::max(widest, 1.0)));
  return (static_cast<int>(key.size()) + columns - 1) / columns;
}

Margins margins_of(const Plot& plot, bool with_title_and_key) {
  Margins margins;
  margins.left = plot.left_px.value_or(left_px_of(plot));
  const bool has_scale = plot.heat_map && plot.heat_map->classes.empty();
  margins.right = heights(plot, has_scale ? scale_heights : right_heights);
  margins.bottom = heights(plot, bottom_heights);
  double lines = 0.5 + static_cast<double>(drawn_marks(plot).size());
  if (with_title_and_key) lines += (plot.title.empty() ? 0 : 1) + key_lines(plot);
  margins.top = heights(plot, line_heights * lines);
  return margins;
}

AxisSpan span_of(const Axis& axis, const AxisRange& range, double length_px, bool horizontal, int text_px) {
  return {range.low, range.high, axis.logarithmic, axis.whole, length_px, horizontal, 1.0 * text_px};
}

std::string axis_settings(const std::string& name, const Axis& axis, const AxisSpan& span) {
  std::string text = axis.logarithmic ? "set logscale " + name + "\n" : "";
  std::string ticks;
  for (const Tick& tick : ticks_of(span))
    ticks += (ticks.empty() ? "" : ", ") + quoted(tick.text) + " " + exact_text(tick.at);
  text += ticks.empty() ? "unset " + name + "tics\n" : "set " + name + "tics (" + ticks + ")\n";
  return text + "set " + name + "range [" + exact_text(span.low) + ":" + exact_text(span.high) + "]\n";
}

/// The labels of the axes at fixed places. gnuplot would move them with the widths of the tick texts.
std::string axis_labels(const Plot& plot, const Margins& margins) {
  constexpr double from_edge_heights = 0.9;
  const double edge = from_edge_heights * plot.text_px;
  const std::string ink = " textcolor rgb " + quoted_color(color::soft) + "\n";
  const double middle = margins.bottom + 0.5 * (plot.height_px - margins.top - margins.bottom);
  return "set label " + quoted(plot.x.label) + " at graph 0.5, screen " + exact_text(edge / plot.height_px) +
         " center" + ink + "set label " + quoted(plot.y.label) + " at screen " +
         exact_text(edge / plot.width_px) + ", screen " + exact_text(middle / plot.height_px) +
         " center rotate by 90" + ink;
}

double height_inside(const Plot& plot, const Margins& margins) {
  return std::max(40, plot.height_px - margins.top - margins.bottom);
}

std::string axes(const Plot& plot, const AxisRanges& ranges, const Margins& margins) {
  const double width = std::max(40, plot.width_px - margins.left - margins.right);
  return axis_labels(plot, margins) +
         axis_settings("x", plot.x, span_of(plot.x, ranges.x, width, true, plot.text_px)) +
         axis_settings("y", plot.y,
                       span_of(plot.y, ranges.y, height_inside(plot, margins), false, plot.text_px));
}

/// Bars as wide as the smallest distance between two. By default gnuplot fills gaps with wide bars.
std::string bar_width(const Plot& plot) {
  double width = std::numeric_limits<double>::infinity();
  for (const Series& series : plot.series)
    for (std::size_t i = 1; series.style == Series::Style::bars && i < series.x.size(); ++i)
      width = std::min(width, std::abs(series.x[i] - series.x[i - 1]));
  return std::isfinite(width) && width > 0.0 ? "set boxwidth " + exact_text(width) + " absolute\n" : "";
}

/// The position of a value along an axis, from 0 to 1.
double part_of(const AxisRange& range, const Axis& axis, double value) {
  const auto on = [&](double v) { return axis.logarithmic ? std::log(v) : v; };
  return (on(value) - on(range.low)) / (on(range.high) - on(range.low));
}

/// Vertical marks with their labels above the frame, each on its own line; then horizontal marks.
std::string marks(const Plot& plot, const AxisRanges& ranges) {
  std::string text;
  const std::string style = " nohead lc rgb " + quoted_color(plot.heat_map ? color::ink : color::soft) +
                            " lw " + (plot.heat_map ? "1.5" : "1") + " dt 3 front\n";
  const std::string ink = " textcolor rgb " + quoted_color(color::soft) + " front\n";
  int line = 0;
  for (const Mark* mark : drawn_marks(plot)) {
    const std::string at = exact_text(mark->at);
    const double part = part_of(ranges.x, plot.x, mark->at);
    text += "set arrow from first " + at + ", graph 0 to first " + at + ", graph 1" + style;
    text += "set label " + quoted(mark->label) + " at first " + at + ", graph 1 " +
            (part < 0.25   ? "left"
             : part > 0.75 ? "right"
                           : "center") +
            " offset 0," + exact_text(0.6 + 1.2 * line++) + ink;
  }
  for (const Mark& mark : plot.horizontal_marks) {
    if (!drawable(mark.at, plot.y)) continue;
    const std::string at = exact_text(mark.at);
    text += "set arrow from graph 0, first " + at + " to graph 1, first " + at + style;
    const bool above = part_of(ranges.y, plot.y, mark.at) < 0.85;
    text += "set label " + quoted(mark.label) + " at graph 0.99, first " + at + " right offset 0," +
            (above ? "0.6" : "-0.7") + ink;
  }
  return text;
}

std::string frame(const Plot& plot, const Margins& margins) {
  const auto part = [](int px, int of) { return exact_text(static_cast<double>(px) / of); };
  return "set terminal svg size " + std::to_string(plot.width_px) + "," + std::to_string(plot.height_px) +
         " noenhanced font 'sans-serif," + std::to_string(plot.text_px) +
         "' background '#ffffff'\n"
         "set encoding utf8\n"
         "set border 3 lc rgb " +
         quoted_color(color::soft) + "\nset grid lc rgb " + quoted_color(color::grid) +
         " lt 1\nset tics nomirror out scale 0.5\nset lmargin at screen " +
         part(margins.left, plot.width_px) + "\nset rmargin at screen " +
         part(plot.width_px - margins.right, plot.width_px) + "\nset tmargin at screen " +
         part(plot.height_px - margins.top, plot.height_px) + "\nset bmargin at screen " +
         part(margins.bottom, plot.height_px) + "\n";
}

std::string title_and_key(const Plot& plot) {
  const double line = line_heights * plot.text_px / plot.height_px;  // part of the drawing
  std::string text = "set key at graph 0, screen " +
                     exact_text(1.0 - (plot.title.empty() ? 0.3 : 1.3) * line) +
                     " left top horizontal Left reverse samplen 2\n";
  if (!plot.title.empty())
    text += "set label " + quoted(plot.title) + " at graph 0, screen " + exact_text(1.0 - 0.7 * line) +
            " left font '," + std::to_string(plot.text_px + 2) + "'\n";
  return text;
}

std::string script_for(const Plot& plot, bool with_title_and_key) {
  Curves curves;
  const Margins margins = margins_of(plot, with_title_and_key);
  const AxisRanges ranges = ranges_of(plot);
  std::string settings = frame(plot, margins) + axes(plot, ranges, margins) + bar_width(plot);
  settings += with_title_and_key ? title_and_key(plot) : "unset key\n";
  add_heat_map(plot, curves, settings);
  add_bands(plot, curves);
  add_series(plot, curves);
  settings += marks(plot, ranges);
  if (curves.commands.empty()) {
    settings += "set label 'no data' at graph 0.5, graph 0.5 center\n";
    curves.commands = "plot NaN notitle";
  }
  return settings + curves.blocks + curves.commands + "\n";
}

void replace_all(std::string& text, std::string_view from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

/// Turns the SVG document that gnuplot writes into an element of a page: with unique identifiers, and without
/// references to anything outside.
std::string as_element(std::string svg, const std::string& id) {
  const std::size_t begin = svg.find("<svg");
  const std::size_t end = svg.rfind("</svg>");
  require(begin != std::string::npos && end != std::string::npos, "drawing is not SVG");
  svg = svg.substr(begin, end + 6 - begin);
  replace_all(svg, " xmlns=\"http://www.w3.org/2000/svg\"", "");
  replace_all(svg, " xmlns:xlink=\"http://www.w3.org/1999/xlink\"", "");
  replace_all(svg, "xlink:href=", "href=");
  for (const char quote : {'\'', '"'}) {
    replace_all(svg, std::string(" id=") + quote, std::string(" id=") + quote + id);
    replace_all(svg, std::string("href=") + quote + "#", std::string("href=") + quote + "#" + id);
  }
  replace_all(svg, "url(#", "url(#" + id);
  // gnuplot adds titles that browsers show as tooltips. They carry no information.
  for (const std::string_view name : {"<title>Gnuplot", "<title>gnuplot_plot"})
    for (std::size_t at = svg.find(name); at != std::string::npos; at = svg.find(name, at))
      svg.erase(at, svg.find("</title>", at) + 8 - at);
  return svg;
}

}  // namespace

std::vector<std::size_t> thinned(const std::vector<double>& x, const std::vector<double>& y,
                                 std::size_t columns) {
  const std::size_t count = std::min(x.size(), y.size());
  std::vector<std::size_t> kept;
  const std::size_t bucket = std::max<std::size_t>(1, count / std::max<std::size_t>(1, columns));
  if (bucket < 4) {
    for (std::size_t i = 0; i < count; ++i) kept.push_back(i);
    return kept;
  }
  for (std::size_t begin = 0; begin < count; begin += bucket) {
    const std::size_t end = std::min(begin + bucket, count);
    std::size_t low = count;
    std::size_t high = count;
    std::size_t gap = count;
    for (std::size_t i = begin; i < end; ++i) {
      if (!std::isfinite(y[i])) {
        gap = i;
        continue;
      }
      if (low == count || y[i] < y[low]) low = i;
      if (high == count || y[i] > y[high]) high = i;
    }
    std::array<std::size_t, 5> chosen{begin, low, high, gap, end - 1};
    std::sort(chosen.begin(), chosen.end());
    for (const std::size_t i : chosen)
      if (i < count && (kept.empty() || kept.back() < i)) kept.push_back(i);
  }
  return kept;
}

Series histogram(const std::vector<std::pair<double, std::uint64_t>>& values, std::size_t bins,
                 const std::string& name) {
  Series series;
  series.name = name;
  series.style = Series::Style::bars;
  if (values.empty() || bins == 0) return series;
  const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
  const double low = smallest->first, high = largest->first;
  const double width =
      std::max((high - low) / static_cast<double>(bins), 1e-9 * std::max(1.0, std::abs(high)));
  for (std::size_t i = 0; i < bins; ++i) series.x.push_back(low + (static_cast<double>(i) + 0.5) * width);
  series.y.assign(bins, 0.0);
  for (const auto& [value, times] : values) {
    const auto bin = static_cast<std::size_t>((value - low) / width);
    series.y[std::min(bin, bins - 1)] += static_cast<double>(times);
  }
  return series;
}

std::vector<KeyEntry> key_of(const Plot& plot) {
  using Swatch = KeyEntry::Swatch;
  std::vector<KeyEntry> key;
  if (plot.heat_map)
    for (const std::string& name : plot.heat_map->classes)
      key.push_back({name, color::of_outcome(name), Swatch::area});
  for (const Band& band : plot.bands)
    if (!band.name.empty()) key.push_back({band.name, color::band, Swatch::area});
  const std::vector<std::string_view> colors = colors_of(plot);
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const Series& series = plot.series[k];
    if (series.name.empty() || series.x.empty()) continue;
    const Swatch swatch = series.style == Series::Style::points ? Swatch::point
                          : series.style == Series::Style::bars ? Swatch::area
                          : series.dashed                       ? Swatch::dashed
                                                                : Swatch::line;
    key.push_back({series.name, colors[k], swatch});
  }
  return key;
}

int left_px_of(const Plot& plot) {
  double widest = 0.0;
  const double height = plot.height_px - heights(plot, bottom_heights + line_heights);
  for (const Tick& tick : ticks_of(span_of(plot.y, ranges_of(plot).y, height, false, plot.text_px)))
    widest = std::max(widest, text_width_px(tick.text, plot.text_px));
  constexpr double label_heights = 2.5;  // the axis's own label, and the tick
  return std::max(heights(plot, min_left_heights), heights(plot, label_heights) + static_cast<int>(widest));
}

void align(std::vector<Plot>& plots) {
  int left = 0;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Plot& plot : plots) {
    left = std::max(left, left_px_of(plot));
    const AxisRange x = ranges_of(plot).x;
    low = std::min(low, x.low);
    high = std::max(high, x.high);
  }
  for (Plot& plot : plots) {
    plot.left_px = left;
    plot.x.low = low;
    plot.x.high = high;
  }
}

std::string svg_of(const Plot& plot, const std::string& id) {
  return as_element(gnuplot_output(script_for(plot, false)), id);
}

std::string svg_file_of(const Plot& plot) {
  Plot whole = plot;  // the axes keep their height; title and key come on top
  whole.height_px += margins_of(plot, true).top - margins_of(plot, false).top;
  const std::string element = as_element(gnuplot_output(script_for(whole, true)), "p");
  return "<svg xmlns=\"http://www.w3.org/2000/svg\"" + element.substr(4) + "\n";
}

}  // namespace upright
