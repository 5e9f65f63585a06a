// A report page: one self-contained HTML file (no scripts, no external fonts or pictures), light and
// printable. All text is escaped.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "base/number_text.hpp"
#include "plot.hpp"

namespace upright {

/// `text` for use inside HTML: markup is escaped, control characters and broken UTF-8 are replaced.
std::string html_escaped(const std::string& text);

/// Whether the answer of a page is good, neutral or bad; decides its colour.
enum class Tone { good, warning, bad, neutral };

struct HtmlTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::string caption;
  std::vector<std::string> links = {};  ///< for the first cell of each row; empty: none there, or nowhere
};

/// One bar of a bar chart whose lengths are magnitudes above `floor`, on a logarithmic scale.
struct HtmlBar {
  std::string name;
  double value = 0.0;
  std::string_view color = color::after;
};

/// A link to a file beside a page: its path with what a browser would misread written as %XX.
std::string link_to(const std::filesystem::path& relative);

class HtmlPage {
 public:
  /// `subtitle` is shown in small type under the title: what, when, where.
  HtmlPage(std::string title, std::string subtitle);

  /// The answer, at the top of the page.
  void answer(Tone tone, const std::string& headline, const std::string& sentence);
  void section(const std::string& heading);
  void paragraph(const std::string& text);
  /// A highlighted remark.
  void note(Tone tone, const std::string& text);
  /// Numbers are aligned to the right. In a window that is too narrow for the table, each row becomes a list.
  void table(const HtmlTable& table);
  /// A bar for each name, with its value. A value of `floor` has length zero.
  void bars(const std::vector<HtmlBar>& bars, double floor, const std::string& caption);
  /// Names and their values, in two columns if the window is wide enough.
  void facts(const std::vector<std::pair<std::string, std::string>>& facts);
  void figure(const Plot& plot, const std::string& caption);
  /// Two figures side by side if the window is wide enough.
  void figures(const std::vector<Plot>& plots, const std::string& caption);
  /// Plots in one column with a common horizontal axis.
  void stack(std::vector<Plot> plots, const std::string& caption);
  /// Unchanged text in a monospaced font.
  void preformatted(const std::string& text);
  /// Unchanged text, such as a configuration file, folded under its heading.
  void folded(const std::string& heading, const std::string& text);

  std::string text() const;
  /// Writes the complete page or nothing. Throws Error if it cannot.
  void write(const std::filesystem::path& file) const;

 private:
  void draw(const std::vector<Plot>& plots);
  std::string next_id();
  std::string title_;
  std::string subtitle_;
  std::string body_;
  int figures_ = 0;
};

}  // namespace upright
