#include "histogram_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "upright/model/elementary.hpp"

namespace upright {

namespace {

constexpr std::size_t line_width = 100, label_width = 17, count_width = 9, gap_width = 2;

// From 1 us to 10 s in steps of 1, 2 and 5; a last bin takes what is beyond.
constexpr std::array<double, 22> edges_us = {1,   2,   5,   1e1, 2e1, 5e1, 1e2, 2e2, 5e2, 1e3, 2e3,
                                             5e3, 1e4, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6, 2e6, 5e6, 1e7};
constexpr std::size_t bins = edges_us.size() + 1;

using Counts = std::array<std::uint64_t, bins>;

Counts binned(const DurationHistogram& durations) {
  Counts counts{};
  double begin_us = 0.0;
  for (std::size_t i = 0; i < durations.buckets().size(); ++i) {
    const double end_us = 1e-3 * static_cast<double>(DurationHistogram::upper_end_ns(i));
    const double middle_us = 0.5 * (begin_us + end_us);
    const auto bin = std::upper_bound(edges_us.begin(), edges_us.end(), middle_us) - edges_us.begin();
    counts[static_cast<std::size_t>(bin)] += durations.buckets()[i];
    begin_us = end_us;
  }
  return counts;
}

std::string in_words(double us) {
  char text[24];
  if (us < 1e3)
    std::snprintf(text, sizeof text, "%.0f us", us);
  else if (us < 1e6)
    std::snprintf(text, sizeof text, "%.0f ms", us * 1e-3);
  else
    std::snprintf(text, sizeof text, "%.0f s", us * 1e-6);
  return text;
}

std::string label_of(std::size_t bin) {
  if (bin == 0) return "below " + in_words(edges_us.front());
  if (bin == edges_us.size()) return "above " + in_words(edges_us.back());
  return in_words(edges_us[bin - 1]) + " to " + in_words(edges_us[bin]);
}

std::string right(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text.size()), ' ') + text;
}

std::string left(const std::string& text, std::size_t width) {
  return text + std::string(width - std::min(width, text.size()), ' ');
}

/// A single one is seen, the largest count fills the width.
std::string bar_of(std::uint64_t count, std::uint64_t largest, std::size_t width) {
  if (count == 0) return "";
  const double share =
      elementary::log(1.0 + static_cast<double>(count)) / elementary::log(1.0 + static_cast<double>(largest));
  return std::string(
      std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(share * static_cast<double>(width)))),
      '#');
}

std::string trimmed(std::string text) {
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

}  // namespace

std::vector<std::string> histogram_lines(const std::vector<NamedHistogram>& histograms) {
  std::vector<Counts> columns;
  std::uint64_t largest = 0;
  std::size_t first = bins, last = 0;
  for (const NamedHistogram& histogram : histograms) {
    columns.push_back(binned(histogram.durations));
    for (std::size_t i = 0; i < bins; ++i) {
      if (columns.back()[i] == 0) continue;
      largest = std::max(largest, columns.back()[i]);
      first = std::min(first, i);
      last = std::max(last, i);
    }
  }
  if (largest == 0) return {};
  const std::size_t bar_width = (line_width - label_width) / histograms.size() - count_width - 1 - gap_width;
  std::string header(label_width, ' ');
  for (const NamedHistogram& histogram : histograms)
    header +=
        left(std::string(count_width + 1, ' ') + histogram.name, count_width + 1 + bar_width + gap_width);
  std::vector<std::string> lines{trimmed(header)};
  for (std::size_t i = first; i <= last; ++i) {
    std::string line = right(label_of(i), label_width);
    for (const Counts& counts : columns)
      line += right(std::to_string(counts[i]), count_width) + " " +
              left(bar_of(counts[i], largest, bar_width), bar_width + gap_width);
    lines.push_back(trimmed(line));
  }
  return lines;
}

}  // namespace upright
