#include "upright/report/html.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <system_error>

#include "upright/model/error.hpp"

namespace upright {

namespace {

constexpr std::string_view style = R"(
body{font:16px/1.5 system-ui,sans-serif;color:#1d2733;background:#fff;max-width:60rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.6rem;margin:0}h2{font-size:1.15rem;margin:2.2rem 0 .6rem;border-bottom:1px solid #d8dee6;padding-bottom:.2rem}
.sub{color:#5a6775;margin:.2rem 0 1.2rem;overflow-wrap:anywhere}
.answer{border-left:.5rem solid;border-radius:.3rem;padding:.8rem 1.1rem;margin:1rem 0}
.answer strong{font-size:1.3rem;display:block}
.note{border-left:.25rem solid;padding:.4rem .9rem;margin:.8rem 0}
.good{border-color:#00795a;background:#eaf6f2}.warning{border-color:#b97a00;background:#fdf5e4}
.bad{border-color:#b3261e;background:#fcecea}.neutral{border-color:#56708c;background:#eef2f6}
table{border-collapse:collapse;margin:.8rem 0;font-size:.92rem}
caption{text-align:left;color:#5a6775;padding-bottom:.3rem}
th,td{text-align:left;padding:.25rem .9rem .25rem 0;border-bottom:1px solid #e6eaef;vertical-align:top;overflow-wrap:anywhere}
th{color:#5a6775;font-weight:600}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
dl{display:grid;grid-template-columns:repeat(auto-fit,minmax(26rem,1fr));column-gap:2rem;margin:.8rem 0;font-size:.92rem}
dl div{display:flex;gap:1rem;padding:.25rem 0;border-bottom:1px solid #e6eaef}
dt{flex:0 0 15rem;color:#5a6775;font-weight:600}dd{margin:0;overflow-wrap:anywhere;min-width:0}
figure{margin:1rem 0}figure svg{display:block;width:100%;height:auto}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(22rem,1fr));gap:.5rem}
figcaption{color:#5a6775;font-size:.9rem}
pre{background:#f5f7f9;border:1px solid #e1e6eb;border-radius:.3rem;padding:.8rem;overflow:auto;font-size:.85rem;line-height:1.35}
summary{cursor:pointer;color:#24527a;margin:.5rem 0}
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

bool reads_as_number(const std::string& text) {
  const bool has_digit = std::any_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  return has_digit && text.find_first_not_of("0123456789+-.eE ,%") == std::string::npos;
}

std::string cell(const std::string& text, const char* tag, bool number) {
  return std::string("<") + tag + (number ? " class=\"n\">" : ">") + html_escaped(text) + "</" + tag + ">";
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

std::string number_text(double value, int digits) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*g", std::clamp(digits, 1, 17), value);
  return buffer;
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
  body_ += "<table>";
  if (!table.caption.empty()) body_ += "<caption>" + html_escaped(table.caption) + "</caption>";
  body_ += "<thead><tr>";
  for (std::size_t i = 0; i < table.header.size(); ++i) body_ += cell(table.header[i], "th", numeric[i]);
  body_ += "</tr></thead><tbody>\n";
  for (const auto& row : table.rows) {
    body_ += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i)
      body_ += cell(row[i], "td", i < numeric.size() && numeric[i]);
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table>\n";
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

void HtmlPage::figures(const std::vector<Plot>& plots, const std::string& caption) {
  body_ += "<figure>";
  if (plots.size() > 1) body_ += "<div class=\"pair\">";
  for (const Plot& plot : plots) body_ += svg_of(plot, next_id()) + "\n";
  if (plots.size() > 1) body_ += "</div>";
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
         html_escaped(title_) + "</title>\n<style>" + std::string(style) + "</style></head>\n<body>\n<h1>" +
         html_escaped(title_) + "</h1>\n<p class=\"sub\">" + html_escaped(subtitle_) + "</p>\n" + body_ +
         "</body></html>\n";
}

void HtmlPage::write(const std::filesystem::path& file) const {
  std::filesystem::path part = file;
  part += ".part";
  std::error_code problem;
  // What stands there may be a link that came with somebody else's folder: a new file, never through it.
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
  throw Error(ExitCode::usage,
              "check the folder, its permissions and its free space: cannot write " + file.string());
}

}  // namespace upright
