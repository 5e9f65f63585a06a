// A report page: one HTML file that stands alone (no script, no font, no picture from elsewhere), light, and
// printable. Everything given as text is escaped.
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

/// How good the news is.
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
  /// `subtitle` stands small under the title: what, when, where.
  HtmlPage(std::string title, std::string subtitle);

  /// The answer, first thing on the page.
  void answer(Tone tone, const std::string& headline, const std::string& sentence);
  void section(const std::string& heading);
  void paragraph(const std::string& text);
  /// A remark set off from the text.
  void note(Tone tone, const std::string& text);
  /// Cells that read as numbers are aligned to the right.
  /// Where the window is too narrow for a table's words, each row becomes a small list of its own.
  void table(const HtmlTable& table);
  /// A bar for each name, with its value; the smallest length is `floor`'s.
  void bars(const std::vector<HtmlBar>& bars, double floor, const std::string& caption);
  /// Names and their values, in two columns where there is room.
  void facts(const std::vector<std::pair<std::string, std::string>>& facts);
  void figure(const Plot& plot, const std::string& caption);
  /// Two figures beside each other where the window is wide enough.
  void figures(const std::vector<Plot>& plots, const std::string& caption);
  /// Plots above each other whose horizontal axes align: same range, same place.
  void stack(std::vector<Plot> plots, const std::string& caption);
  /// Text as it is, in a fixed pitch.
  void preformatted(const std::string& text);
  /// Text as it is (a configuration file, say), folded away under its heading.
  void folded(const std::string& heading, const std::string& text);

  std::string text() const;
  /// Writes the page whole or not at all. Throws Error when it cannot.
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
