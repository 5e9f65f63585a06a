#include "http_request.hpp"

#include <algorithm>

namespace upright {

namespace {

constexpr std::string_view line_end = "\r\n";

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

bool is_visible(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 0x7f; });
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// "METHOD /path?query HTTP/1.1"
bool read_request_line(std::string_view line, HttpRequest& request) {
  const std::size_t first = line.find(' '), last = line.rfind(' ');
  if (first == std::string_view::npos || first == last) return false;
  request.method = line.substr(0, first);
  const std::string_view target = line.substr(first + 1, last - first - 1);
  const std::string_view version = line.substr(last + 1);
  request.path = target.substr(0, target.find('?'));
  return is_visible(request.method) && is_visible(target) && (version == "HTTP/1.1" || version == "HTTP/1.0");
}

bool read_field(std::string_view line, HttpRequest& request) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || !is_visible(line.substr(0, colon))) return false;
  request.fields[request.field_count++] = {line.substr(0, colon), trimmed(line.substr(colon + 1))};
  return true;
}

}  // namespace

std::string_view HttpRequest::value_of(std::string_view name) const {
  for (std::size_t i = 0; i < field_count; ++i)
    if (same_name(fields[i].name, name)) return fields[i].value;
  return {};
}

std::size_t HttpRequest::count_of(std::string_view name) const {
  return static_cast<std::size_t>(
      std::count_if(fields.begin(), fields.begin() + static_cast<std::ptrdiff_t>(field_count),
                    [&](const Field& field) { return same_name(field.name, name); }));
}

HeadReading read_head(std::string_view text, HttpRequest& request) {
  request = {};
  std::size_t lines = 0;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text.find(line_end, begin);
    const std::size_t length = (end == std::string_view::npos ? text.size() : end) - begin;
    if (length > longest_line_bytes) return HeadReading::too_large;
    if (end == std::string_view::npos)
      return text.size() < longest_head_bytes ? HeadReading::incomplete : HeadReading::too_large;
    const std::string_view line = text.substr(begin, length);
    begin = end + line_end.size();
    if (line.empty()) return lines > 0 ? HeadReading::complete : HeadReading::malformed;
    if (request.field_count == max_header_fields) return HeadReading::too_large;
    const bool good = lines == 0 ? read_request_line(line, request) : read_field(line, request);
    if (!good) return HeadReading::malformed;
    ++lines;
  }
}

}  // namespace upright
