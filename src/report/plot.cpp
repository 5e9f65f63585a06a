#include "upright/report/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "gnuplot.hpp"
#include "upright/model/error.hpp"
#include "upright/model/yaml_reader.hpp"

namespace upright {

namespace {

// Okabe and Ito's palette, which colour-blind readers can tell apart.
constexpr std::array<const char*, 7> palette = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                "#e69f00", "#56b4e9", "#555555"};
constexpr std::array<const char*, 5> class_colors = {"#009e73", "#f0c000", "#c1272d", "#7a7a7a", "#56b4e9"};

/// Text in gnuplot's single quotes. gnuplot passes numeric character references through, so every character
/// that means something to gnuplot, to SVG or to `as_element` below goes in as one.
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

void require(bool good, const std::string& what) {
  if (!good) throw Error(ExitCode::usage, "report this as a bug: a plot's " + what);
}

/// gnuplot's own arithmetic overflows near the ends of a double's range; no quantity of ours lives there.
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
  } else {
    for (std::size_t i = 0; i < series.x.size(); ++i) append(i);
  }
  return text;
}

/// A curve that is drawn: its data block and the part of the plot command that shows it.
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
    curves.add(data, "using 1:2:3 with filledcurves lc rgb '#d6e6f2'", band.name);
  }
}

void add_series(const Plot& plot, Curves& curves) {
  int next_color = 0;
  for (const Series& series : plot.series) {
    require(series.x.size() == series.y.size(), "series has unequal lengths");
    const int chosen = series.color >= 0 ? series.color : next_color++;
    // On a map's colours only black is seen everywhere.
    const std::string color =
        plot.heat_map ? "#000000" : palette[static_cast<std::size_t>(chosen) % palette.size()];
    const std::string line = " lc rgb '" + color + "' lw 1.4" + (series.dashed ? " dt 2" : "");
    std::string how;
    switch (series.style) {
      case Series::Style::line:
        how = "with lines" + line;
        break;
      case Series::Style::steps:
        how = "with steps" + line;
        break;
      case Series::Style::points:
        // Few points are seen one by one; many are a cloud.
        how = std::string("with points pt 7 ps ") + (series.x.size() < 200 ? "0.8" : "0.35") + " lc rgb '" +
              color + "'";
        break;
      case Series::Style::bars:
        how = "with boxes fs solid 1.0 noborder lc rgb '" + color + "'";
        break;
    }
    curves.add(line_data(series, plot), how, series.name);
  }
}

/// The edges between cell centres; the outer cells are as wide as their neighbours. With a logarithmic axis
/// the middle is the geometric one.
std::vector<double> edges_of(const std::vector<double>& centres, const Axis& axis) {
  const auto to = [&](double v) { return axis.logarithmic ? std::log(v) : v; };
  const auto from = [&](double v) { return axis.logarithmic ? std::exp(v) : v; };
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
  if (map.classes.empty())
    return "set palette defined (0 '#f4f8fb', 0.35 '#7fb3d5', 0.7 '#1f618d', 1 '#0b2545')\nset cblabel " +
           quoted(map.label) + "\n";
  std::string text = "set palette maxcolors " + std::to_string(map.classes.size()) + " defined (";
  for (std::size_t k = 0; k < map.classes.size(); ++k)
    text += (k == 0 ? "" : ", ") + std::to_string(k) + " '" + class_colors[k % class_colors.size()] + "'";
  if (map.classes.size() == 1) text += std::string(", 1 '") + class_colors[0] + "'";
  text +=
      ")\nset cbrange [-0.5:" + exact_text(static_cast<double>(map.classes.size()) - 0.5) + "]\nset cbtics (";
  for (std::size_t k = 0; k < map.classes.size(); ++k)
    text += (k == 0 ? "" : ", ") + quoted(map.classes[k]) + " " + std::to_string(k);
  return text + ") scale 0\nset cblabel " + quoted(map.label) + "\n";
}

void add_heat_map(const Plot& plot, Curves& curves, std::string& settings) {
  if (!plot.heat_map) return;
  const HeatMap& map = *plot.heat_map;
  require(!map.x.empty() && !map.y.empty() && map.values.size() == map.x.size() * map.y.size(),
          "heat map has the wrong number of values");
  settings += color_scale(map);
  curves.add(cells_data(map, plot), "using 1:2:3:4:5:6:7 with boxxyerror fs solid noborder fc palette", "");
  const std::vector<double> x_edges = edges_of(map.x, plot.x);
  const std::vector<double> y_edges = edges_of(map.y, plot.y);
  const auto range = [](const std::vector<double>& edges, const Axis& axis) {
    return "range [" + exact_text(axis.low.value_or(edges.front())) + ":" +
           exact_text(axis.high.value_or(edges.back())) + "]\n";
  };
  settings += "set x" + range(x_edges, plot.x) + "set y" + range(y_edges, plot.y);
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

/// A range for an axis. gnuplot complains of an empty one and rounds a given one; this leaves a small margin.
std::string axis_settings(const std::string& name, const Axis& axis, const Extent& extent, double margin) {
  std::string text = "set " + name + "label " + quoted(axis.label) + "\n";
  if (axis.logarithmic) text += "set logscale " + name + "\n";
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
  } else {
    double room = margin * (high - low);
    if (high - low <= 1e-12 * std::max(std::abs(low), std::abs(high)) || high == low)
      room = std::max(0.1 * std::abs(high), 1e-6);
    if (!axis.low) low -= room;
    if (!axis.high) high += room;
    if (low == high) high = low + std::max(0.1 * std::abs(low), 1e-6);
  }
  return text + "set " + name + "range [" + exact_text(low) + ":" + exact_text(high) + "]\n";
}

std::string axes(const Plot& plot) {
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
  return axis_settings("x", plot.x, x, room_beside ? 0.03 : 0.0) + axis_settings("y", y_axis, y, 0.06);
}

/// Bars as wide as the closest two are apart: left to itself, gnuplot fills empty places with wide ones.
std::string bar_width(const Plot& plot) {
  double width = std::numeric_limits<double>::infinity();
  for (const Series& series : plot.series)
    for (std::size_t i = 1; series.style == Series::Style::bars && i < series.x.size(); ++i)
      width = std::min(width, std::abs(series.x[i] - series.x[i - 1]));
  return std::isfinite(width) && width > 0.0 ? "set boxwidth " + exact_text(width) + " absolute\n" : "";
}

std::string marks(const Plot& plot) {
  std::string text;
  const std::string style = plot.heat_map ? " nohead lc rgb '#ffffff' lw 2 dt 3 front\n"
                                          : " nohead lc rgb '#888888' lw 1 dt 3 front\n";
  for (const Mark& mark : plot.vertical_marks) {
    if (!drawable(mark.at, plot.x)) continue;
    const std::string at = exact_text(mark.at);
    text += "set arrow from first " + at + ", graph 0 to first " + at + ", graph 1" + style;
    text += "set label " + quoted(mark.label) + " at first " + at +
            (plot.heat_map ? ", graph 1 center offset 0,0.7" : ", graph 0.95 offset 0.5,0") +
            " textcolor rgb '#555555' front\n";
  }
  for (const Mark& mark : plot.horizontal_marks) {
    if (!drawable(mark.at, plot.y)) continue;
    const std::string at = exact_text(mark.at);
    text += "set arrow from graph 0, first " + at + " to graph 1, first " + at + style;
    text += "set label " + quoted(mark.label) + " at graph 0.99, first " + at +
            " right offset 0,0.5 textcolor rgb '#555555' front\n";
  }
  return text;
}

/// Room for the key: two names stand beside each other, and two rows of them fit in the usual three.
std::size_t rows_above(const Plot& plot) {
  const auto named = static_cast<std::size_t>(
      std::count_if(plot.series.begin(), plot.series.end(), [](const Series& s) { return !s.name.empty(); }));
  return named > 4 ? 3 + (named - 3) / 2 : 3;
}

std::string script_for(const Plot& plot) {
  Curves curves;
  std::string settings = "set terminal svg size " + std::to_string(plot.width_px) + "," +
                         std::to_string(plot.height_px) +
                         " noenhanced font 'sans-serif,12' background '#ffffff'\n"
                         "set encoding utf8\n"
                         "set border lc rgb '#555555'\n"
                         "set grid lc rgb '#dddddd' lt 1\n"
                         "set tics nomirror\n"
                         "set format '%g'\n"
                         "set key above right horizontal\n"
                         "set tmargin " +
                         std::to_string(rows_above(plot)) + "\n";
  if (!plot.title.empty())
    settings += "set label " + quoted(plot.title) + " at graph 0, graph 1 left offset 0,0.9 font ',14'\n";
  settings += axes(plot) + bar_width(plot);
  add_heat_map(plot, curves, settings);
  add_bands(plot, curves);
  add_series(plot, curves);
  settings += marks(plot);
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

/// gnuplot writes a document of its own; a page wants the element, with identifiers that are its own and
/// without references to anything elsewhere.
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
  // gnuplot names each curve for the pointer to show: "gnuplot_plot_1" tells nobody anything.
  for (std::size_t at = svg.find("<title>gnuplot_plot"); at != std::string::npos;
       at = svg.find("<title>gnuplot_plot", at))
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
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double low = least->first, high = most->first;
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

std::string svg_of(const Plot& plot, const std::string& id) {
  return as_element(gnuplot_output(script_for(plot)), id);
}

std::string svg_file_of(const Plot& plot) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\"" + svg_of(plot, "p").substr(4) + "\n";
}

}  // namespace upright
