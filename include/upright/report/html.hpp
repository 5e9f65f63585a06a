// A report page: one HTML file that stands alone (no script, no font, no picture from elsewhere), light, and
// printable. Everything given as text is escaped.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "upright/report/plot.hpp"

namespace upright {

/// `text` for use inside HTML: markup is escaped, control characters and broken UTF-8 are replaced.
std::string html_escaped(const std::string& text);

/// How good the news is.
enum class Tone { good, warning, bad, neutral };

struct HtmlTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::string caption;
};

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
  void table(const HtmlTable& table);
  /// Names and their values, in two columns where there is room.
  void facts(const std::vector<std::pair<std::string, std::string>>& facts);
  void figure(const Plot& plot, const std::string& caption);
  /// Two figures beside each other where the window is wide enough.
  void figures(const std::vector<Plot>& plots, const std::string& caption);
  /// Text as it is, in a fixed pitch.
  void preformatted(const std::string& text);
  /// Text as it is (a configuration file, say), folded away under its heading.
  void folded(const std::string& heading, const std::string& text);

  std::string text() const;
  /// Writes the page whole or not at all. Throws Error when it cannot.
  void write(const std::filesystem::path& file) const;

 private:
  std::string next_id();
  std::string title_;
  std::string subtitle_;
  std::string body_;
  int figures_ = 0;
};

/// A number for a reader: `digits` significant digits.
std::string number_text(double value, int digits = 4);

}  // namespace upright
