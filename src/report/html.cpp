#include "html.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <system_error>

#include "upright/base/error.hpp"

namespace upright {

namespace {

// Two drawings of each wide plot: the one for narrow windows has fewer ticks and texts of the same size.
constexpr int narrow_px = 380, tallest_narrow_px = 340;
constexpr int widest_beside_px = 480;  // a drawing that is legible in a narrow window as it is

constexpr std::string_view style_sheet = R"(
*{box-sizing:border-box}
body{font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:#fff;max-width:60rem;margin:2rem auto;padding:0 1rem;overflow-wrap:break-word}
h1{font-size:1.6rem;line-height:1.25;margin:0}h2{font-size:1.15rem;margin:2.2rem 0 .6rem;border-bottom:1px solid var(--line);padding-bottom:.2rem}
h3{font-size:1rem;margin:1.4rem 0 .2rem}a{color:var(--cart)}
.sub{color:var(--soft);margin:.2rem 0 1.2rem}
.answer{border-left:.5rem solid;border-radius:.3rem;padding:.8rem 1.1rem;margin:1rem 0}
.answer strong{font-size:1.3rem;line-height:1.3;display:block}
.note{border-left:.25rem solid;padding:.4rem .9rem;margin:.8rem 0}
.good{border-color:var(--good);background:var(--good-ground)}.warning{border-color:var(--wait);background:var(--wait-ground)}
.bad{border-color:var(--bad);background:var(--bad-ground)}.neutral{border-color:var(--neutral);background:var(--neutral-ground)}
table{border-collapse:collapse;margin:.8rem 0;font-size:.92rem}
caption{text-align:left;color:var(--soft);padding-bottom:.3rem}
th,td{text-align:left;padding:.25rem .9rem .25rem 0;border-bottom:1px solid var(--grid);vertical-align:top}
th:last-child,td:last-child{padding-right:0}
th{color:var(--soft);font-weight:600}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}td.n{white-space:nowrap}
dl{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(26rem,100%),1fr));column-gap:2rem;margin:.8rem 0;font-size:.92rem}
dl div{display:flex;flex-wrap:wrap;column-gap:1rem;padding:.25rem 0;border-bottom:1px solid var(--grid)}
dt{flex:0 0 15rem;color:var(--soft);font-weight:600}dd{margin:0;min-width:0;max-width:100%}
figure{margin:1rem 0}.plot{min-width:0}.small{max-width:32rem}.plot>div>svg{display:block;width:100%;height:auto}.narrow{display:none}
.plot p{font-weight:600;font-size:.95rem;margin:.4rem 0 0}
.key{list-style:none;display:flex;flex-wrap:wrap;gap:.1rem 1.2rem;margin:.1rem 0;padding:0;font-size:.85rem}
.key svg{width:24px;height:10px;margin-right:.4rem}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(22rem,100%),1fr));gap:.5rem}
figcaption{color:var(--soft);font-size:.9rem}
.bars{list-style:none;margin:.8rem 0;padding:0}.bars li{margin:.5rem 0}
.bars .of{display:flex;justify-content:space-between;gap:1rem}.bars b{font-variant-numeric:tabular-nums}
.bars .bar{height:1rem;min-width:2px;border-radius:.2rem}
pre{background:#f5f7f9;border:1px solid var(--line);border-radius:.3rem;padding:.8rem;overflow:auto;font-size:.85rem;line-height:1.35}
summary{cursor:pointer;color:var(--cart);margin:.5rem 0}
@media screen and (max-width:48rem){
body{margin:1rem auto}.wide.has-narrow{display:none}.narrow{display:block;max-width:32rem}
.rows,.rows tbody,.rows tr,.rows td,.rows caption{display:block}.rows thead{display:none}
.rows tr{border-bottom:2px solid var(--line);padding:.4rem 0}
.rows td{display:flex;flex-wrap:wrap;justify-content:space-between;column-gap:1rem;border:0;padding:.1rem 0;text-align:left}
.rows td:empty{display:none}.rows td[data-h]::before{content:attr(data-h);color:var(--soft)}
.rows td:first-child{font-weight:600}}
@media print{body{max-width:none;margin:0}figure,table,dl div,.answer{break-inside:avoid}h2{break-after:avoid}}
)";

const char* class_of(Tone tone) {
  switch (tone) {
    case Tone::good:
      return "good";
    case Tone::warning:
      return "warning";
    case Tone::bad:
      return "bad";
    case Tone::neutral:
      break;
  }
  return "neutral";
}

/// The length of the valid UTF-8 sequence at `at`; 0 when there is none.
std::size_t utf8_length(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t i) -> unsigned { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(at);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 && first <= 0xf4  ? 4
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xc2 && first < 0xe0 ? 2
                                                             : 0;
  if (length == 0 || at + length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(at + i) & 0xc0u) != 0x80u) return 0;
  const unsigned second = byte(at + 1);
  const bool overlong_or_surrogate = (first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) ||
                                     (first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f);
  return overlong_or_surrogate ? 0 : length;
}

const std::string no_value = "-";  // neither a word nor a number

bool reads_as_number(const std::string& text) {
  const bool has_digit = std::any_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  return text == no_value ||
         (has_digit && text.find_first_not_of("0123456789+-.eE ,%×⁻⁰¹²³⁴⁵⁶⁷⁸⁹") == std::string::npos);
}

/// Whether the columns of this table fit into a narrow window.
bool fits_narrow(const HtmlTable& table) {
  constexpr double character_px = 8.4, padding_px = 15.0, room_px = 360.0;
  std::vector<std::size_t> longest(table.header.size(), 0);
  const auto measure = [&](std::size_t column, const std::string& text) {
    std::size_t length = 0;
    for (const char c : text) {
      length = c == ' ' ? 0 : length + 1;
      longest[column] = std::max(longest[column], length);
    }
  };
  for (std::size_t i = 0; i < longest.size(); ++i) {
    measure(i, table.header[i]);
    for (const auto& row : table.rows)
      if (i < row.size()) measure(i, row[i]);
  }
  double width = 0.0;
  for (const std::size_t length : longest) width += character_px * static_cast<double>(length) + padding_px;
  return width <= room_px;
}

std::string swatch_of(const KeyEntry& entry) {
  const std::string color(entry.color);
  switch (entry.swatch) {
    case KeyEntry::Swatch::point:
      return "<circle cx=\"12\" cy=\"5\" r=\"4\" fill=\"" + color + "\"/>";
    case KeyEntry::Swatch::area:
      return "<rect x=\"4\" width=\"16\" height=\"10\" fill=\"" + color + "\"/>";
    case KeyEntry::Swatch::line:
    case KeyEntry::Swatch::dashed:
      break;
  }
  return "<path d=\"M0 5H24\" stroke-width=\"2.5\" stroke=\"" + color + "\"" +
         (entry.swatch == KeyEntry::Swatch::dashed ? " stroke-dasharray=\"5 4\"" : "") + "/>";
}

std::string cell(const std::string& text, const char* tag, bool number) {
  return std::string("<") + tag + (number ? " class=\"n\">" : ">") + html_escaped(text) + "</" + tag + ">";
}

std::string linked(const std::string& markup, const std::string& link) {
  return link.empty() ? markup : "<a href=\"" + html_escaped(link) + "\">" + markup + "</a>";
}

/// A cell that carries its column's name, for narrow windows, which show each row as a list.
std::string body_cell(const std::string& text, const std::string& heading, const std::string& link,
                      bool number) {
  std::string result = number ? "<td class=\"n\"" : "<td";
  if (!heading.empty()) result += " data-h=\"" + html_escaped(heading) + "\"";
  if (text.empty()) return result + "></td>";
  return result + ">" + linked("<span>" + html_escaped(text) + "</span>", link) + "</td>";
}

}  // namespace

std::string html_escaped(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const char c = text[i];
    if (length == 0 || (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7f)
      result += "\xef\xbf\xbd";
    else if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else if (c == '\'')
      result += "&#39;";
    else
      result += text.substr(i, length);
    i += std::max<std::size_t>(length, 1);
  }
  return result;
}

std::string link_to(const std::filesystem::path& relative) {
  std::string link;
  for (const char c : relative.generic_string()) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
                       std::string_view("/._-~").find(c) != std::string_view::npos;
    if (plain)
      link += c;
    else
      link += {'%', "0123456789ABCDEF"[byte / 16], "0123456789ABCDEF"[byte % 16]};
  }
  // Without this, "//host" would link to another machine.
  return link.starts_with("/") ? link : "./" + link;
}

HtmlPage::HtmlPage(std::string title, std::string subtitle)
    : title_(std::move(title)), subtitle_(std::move(subtitle)) {}

void HtmlPage::answer(Tone tone, const std::string& headline, const std::string& sentence) {
  body_ += std::string("<div class=\"answer ") + class_of(tone) + "\"><strong>" + html_escaped(headline) +
           "</strong>" + html_escaped(sentence) + "</div>\n";
}

void HtmlPage::section(const std::string& heading) {
  body_ += "<h2>" + html_escaped(heading) + "</h2>\n";
}

void HtmlPage::paragraph(const std::string& text) {
  body_ += "<p>" + html_escaped(text) + "</p>\n";
}

void HtmlPage::note(Tone tone, const std::string& text) {
  body_ += std::string("<div class=\"note ") + class_of(tone) + "\">" + html_escaped(text) + "</div>\n";
}

void HtmlPage::table(const HtmlTable& table) {
  std::vector<bool> numeric(table.header.size(), !table.rows.empty());
  for (const auto& row : table.rows)
    for (std::size_t i = 0; i < numeric.size() && i < row.size(); ++i)
      numeric[i] = numeric[i] && (row[i].empty() || reads_as_number(row[i]));
  body_ += fits_narrow(table) ? "<table>" : "<table class=\"rows\">";
  if (!table.caption.empty()) body_ += "<caption>" + html_escaped(table.caption) + "</caption>";
  body_ += "<thead><tr>";
  for (std::size_t i = 0; i < table.header.size(); ++i) body_ += cell(table.header[i], "th", numeric[i]);
  body_ += "</tr></thead><tbody>\n";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const std::vector<std::string>& row = table.rows[r];
    body_ += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i)
      // The first cell heads its row and needs no name.
      body_ +=
          body_cell(row[i], i > 0 && i < table.header.size() ? table.header[i] : "",
                    i == 0 && r < table.links.size() ? table.links[r] : "", i < numeric.size() && numeric[i]);
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table>\n";
}

void HtmlPage::bars(const std::vector<HtmlBar>& bars, double floor, const std::string& caption) {
  double largest = floor;
  for (const HtmlBar& bar : bars)
    if (std::isfinite(bar.value)) largest = std::max(largest, bar.value);
  const double decades = std::max(std::log10(largest / floor), 1e-9);
  body_ += "<figure><ul class=\"bars\">\n";
  for (const HtmlBar& bar : bars) {
    const double part = bar.value > floor ? std::log10(std::min(bar.value, largest) / floor) / decades : 0.0;
    body_ += "<li><div class=\"of\"><span>" + html_escaped(bar.name) + "</span><b>" +
             html_escaped(number_text(bar.value, 3)) +
             "</b></div><div class=\"bar\" style=\"background:" + std::string(bar.color) +
             ";width:" + number_text(100.0 * part, 3) + "%\"></div></li>\n";
  }
  body_ += "</ul><figcaption>" + html_escaped(caption) + "</figcaption></figure>\n";
}

void HtmlPage::facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  body_ += "<dl>\n";
  for (const auto& [name, value] : facts)
    body_ += "<div>" + cell(name, "dt", false) + cell(value, "dd", false) + "</div>\n";
  body_ += "</dl>\n";
}

void HtmlPage::figure(const Plot& plot, const std::string& caption) {
  figures({plot}, caption);
}

void HtmlPage::draw(const std::vector<Plot>& plots) {
  for (const Plot& plot : plots) {
    const bool has_narrow = plot.width_px > widest_beside_px;
    body_ += has_narrow ? "<div class=\"plot\">" : "<div class=\"plot small\">";
    if (!plot.title.empty()) body_ += "<p>" + linked(html_escaped(plot.title), plot.link) + "</p>";
    const std::vector<KeyEntry> key = key_of(plot);
    if (!key.empty()) body_ += "<ul class=\"key\">";
    for (const KeyEntry& entry : key)
      body_ += "<li><svg viewBox=\"0 0 24 10\" aria-hidden=\"true\">" + swatch_of(entry) + "</svg>" +
               html_escaped(entry.name) + "</li>";
    if (!key.empty()) body_ += "</ul>";
    body_ += has_narrow ? "<div class=\"wide has-narrow\">" : "<div class=\"wide\">";
    body_ += svg_of(plot, next_id()) + "</div>";
    if (has_narrow) {
      Plot narrow = plot;
      narrow.width_px = narrow_px;
      narrow.height_px = std::min(plot.height_px, tallest_narrow_px);
      body_ += "<div class=\"narrow\">" + svg_of(narrow, next_id()) + "</div>";
    }
    body_ += "</div>\n";
  }
}

void HtmlPage::figures(const std::vector<Plot>& plots, const std::string& caption) {
  body_ += "<figure>";
  if (plots.size() > 1) body_ += "<div class=\"pair\">";
  draw(plots);
  if (plots.size() > 1) body_ += "</div>";
  if (!caption.empty()) body_ += "<figcaption>" + html_escaped(caption) + "</figcaption>";
  body_ += "</figure>\n";
}

void HtmlPage::stack(std::vector<Plot> plots, const std::string& caption) {
  align(plots);
  body_ += "<figure>";
  draw(plots);
  if (!caption.empty()) body_ += "<figcaption>" + html_escaped(caption) + "</figcaption>";
  body_ += "</figure>\n";
}

void HtmlPage::preformatted(const std::string& text) {
  body_ += "<pre>" + html_escaped(text) + "</pre>\n";
}

void HtmlPage::folded(const std::string& heading, const std::string& text) {
  body_ += "<details><summary>" + html_escaped(heading) + "</summary><pre>" + html_escaped(text) +
           "</pre></details>\n";
}

std::string HtmlPage::next_id() {
  return "figure" + std::to_string(++figures_) + "_";
}

std::string HtmlPage::text() const {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
         "'unsafe-inline'\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         html_escaped(title_) + "</title>\n<style>" + color::css_variables() + std::string(style_sheet) +
         "</style></head>\n<body>\n<h1>" + html_escaped(title_) + "</h1>\n<p class=\"sub\">" +
         html_escaped(subtitle_) + "</p>\n" + body_ + "</body></html>\n";
}

void HtmlPage::write(const std::filesystem::path& file) const {
  std::filesystem::path part = file;
  part += ".part";
  std::error_code problem;
  // The existing file may be a symbolic link in a folder from someone else, so a new file replaces it.
  std::filesystem::remove(part, problem);
  if (std::FILE* out = std::fopen(part.c_str(), "wbx"); out != nullptr) {
    const std::string page = text();
    const bool whole = std::fwrite(page.data(), 1, page.size(), out) == page.size();
    if (std::fclose(out) == 0 && whole)
      std::filesystem::rename(part, file, problem);
    else
      problem = std::make_error_code(std::errc::io_error);
    if (!problem) return;
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
  }
  throw Error(ExitCode::usage, "cannot write " + file.string() +
                                   ": check that the folder exists, its permissions and the free disk space");
}

}  // namespace upright
