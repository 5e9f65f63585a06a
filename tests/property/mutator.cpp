#include "mutator.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace upright::testing {

namespace {

using Random = std::mt19937_64;

constexpr std::size_t longest_text = 300'000;

std::size_t below(Random& random, std::size_t count) {
  return count == 0 ? 0 : static_cast<std::size_t>(random() % count);
}

/// A part of a text.
struct Span {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
};

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.' || c == '+' || c == '-';
}

bool is_number(const std::string& word) {
  return !word.empty() && std::isdigit(static_cast<unsigned char>(word[word.size() - 1])) != 0 &&
         word.find_first_not_of("0123456789.+-eE") == std::string::npos;
}

/// Numbers, or words that are none.
std::vector<Span> words_of(const std::string& text, bool numbers) {
  std::vector<Span> spans;
  for (std::size_t i = 0; i < text.size();) {
    if (!is_word(text[i])) {
      ++i;
      continue;
    }
    Span span{i, i};
    while (span.end < text.size() && is_word(text[span.end])) ++span.end;
    if (is_number(text.substr(span.begin, span.size())) == numbers) spans.push_back(span);
    i = span.end;
  }
  return spans;
}

/// Words that are values: no colon follows them.
std::vector<Span> values_of(const std::string& text) {
  std::vector<Span> spans = words_of(text, false);
  std::erase_if(spans, [&](const Span& s) { return s.end < text.size() && text[s.end] == ':'; });
  return spans;
}

std::vector<Span> lines_of(const std::string& text) {
  std::vector<Span> spans;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    spans.push_back({begin, end == std::string::npos ? text.size() : end + 1});
    begin = spans.back().end;
  }
  return spans;
}

/// Entries of maps and lists in one line: "key: value" between commas and brackets.
std::vector<Span> entries_of(const std::string& text) {
  std::vector<Span> spans;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && std::string("{}[],\n").find(text[i]) == std::string::npos) continue;
    if (i > begin + 1) spans.push_back({begin, i});
    begin = i + 1;
  }
  return spans;
}

/// Whole maps and lists in brackets.
std::vector<Span> groups_of(const std::string& text) {
  std::vector<Span> spans;
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '{' || text[i] == '[') open.push_back(i);
    if ((text[i] == '}' || text[i] == ']') && !open.empty()) {
      spans.push_back({open.back(), i + 1});
      open.pop_back();
    }
  }
  return spans;
}

Span one_of(Random& random, const std::vector<Span>& spans) {
  return spans.empty() ? Span{} : spans[below(random, spans.size())];
}

void replace(std::string& text, const Span& span, const std::string& with) {
  text.replace(span.begin, span.size(), with);
}

std::string cut(const std::string& text, const Span& span) {
  return text.substr(span.begin, span.size());
}

void change_number(std::string& text, Random& random) {
  static const std::array<const char*, 32> ends = {"0",
                                                   "-0.0",
                                                   "-1",
                                                   "1",
                                                   "0.5",
                                                   "2",
                                                   "3",
                                                   "1e-3",
                                                   "1e-6",
                                                   "1e-12",
                                                   "1e-300",
                                                   "5e-324",
                                                   "1e3",
                                                   "1e6",
                                                   "1e9",
                                                   "1e18",
                                                   "1e300",
                                                   "1e999",
                                                   "-1e300",
                                                   "-1e9",
                                                   ".nan",
                                                   ".inf",
                                                   "-.inf",
                                                   "nan",
                                                   "2147483648",
                                                   "4294967296",
                                                   "9223372036854775807",
                                                   "18446744073709551616",
                                                   "0x10",
                                                   "1,5",
                                                   "1_000",
                                                   "07"};
  const Span span = one_of(random, words_of(text, true));
  if (span.size() == 0) return;
  switch (below(random, 5)) {
    case 0:
      text.insert(span.begin, 1, '-');
      return;
    case 1:
      text.insert(span.end, 1, '0');
      return;
    case 2:
      text.insert(span.end, std::to_string(below(random, 40)));
      text.insert(span.end, below(random, 2) == 0 ? "e" : "e-");
      return;
    default:
      replace(text, span, ends[below(random, ends.size())]);
  }
}

void change_word(std::string& text, const std::string& other, Random& random) {
  const Span span = one_of(random, below(random, 3) == 0 ? words_of(text, false) : values_of(text));
  const std::string& source = below(random, 2) == 0 ? text : other;
  const std::string word = cut(source, one_of(random, words_of(source, false)));
  if (span.size() > 0) replace(text, span, word);
}

/// A value becomes what it is not.
void change_shape(std::string& text, Random& random) {
  const Span span = one_of(random, below(random, 3) == 0   ? groups_of(text)
                                   : below(random, 2) == 0 ? words_of(text, true)
                                                           : values_of(text));
  if (span.size() == 0) return;
  const std::string old = cut(text, span);
  switch (below(random, 9)) {
    case 0:
      return replace(text, span, "[" + old + "]");
    case 1:
      return replace(text, span, "{a: " + old + "}");
    case 2:
      return replace(text, span, "~");
    case 3:
      return replace(text, span, "");
    case 4:
      return replace(text, span, "[]");
    case 5:
      return replace(text, span, std::string(below(random, 200), '[') + old);
    case 6: {
      std::string list = "[";
      for (std::size_t i = 0, count = below(random, 3000); i < count; ++i) list += (i > 0 ? ", " : "") + old;
      return replace(text, span, list + "]");
    }
    case 7:
      return replace(text, span, std::string(below(random, 100'000), 'x'));
    default:
      return replace(text, span, "'" + old + "'");
  }
}

/// A line or an entry is left out, doubled, moved, or taken from another file.
void change_order(std::string& text, const std::string& other, Random& random) {
  const bool whole_lines = below(random, 2) == 0;
  const auto parts = [&](const std::string& of) { return whole_lines ? lines_of(of) : entries_of(of); };
  const Span span = one_of(random, parts(text));
  const std::string old = cut(text, span);
  const std::string comma = whole_lines ? "" : ",";
  switch (below(random, 5)) {
    case 0:
      return replace(text, span, "");
    case 1:
      return replace(text, span, old + comma + old);
    case 2:
      return replace(text, span, old + comma + cut(other, one_of(random, parts(other))));
    case 3:
      return replace(text, span, cut(other, one_of(random, parts(other))));
    default: {
      replace(text, span, "");
      text.insert(one_of(random, parts(text)).begin, old + comma);
      return;
    }
  }
}

void swap_group(std::string& text, const std::string& other, Random& random) {
  const Span span = one_of(random, groups_of(text));
  if (span.size() > 0) replace(text, span, cut(other, one_of(random, groups_of(other))));
}

void change_bytes(std::string& text, Random& random) {
  static const std::array<std::string, 12> bits = {std::string(1, '\0'),
                                                   "\xef\xbb\xbf",
                                                   "\xff\xfe",
                                                   "\r",
                                                   "\t",
                                                   "\n",
                                                   ":",
                                                   "#",
                                                   "&a ",
                                                   "*a",
                                                   "---\n",
                                                   "\x80"};
  const std::size_t at = below(random, text.size() + 1);
  const std::size_t length = std::min(text.size() - at, below(random, 40));
  switch (below(random, 6)) {
    case 0:
      if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << below(random, 8)));
      return;
    case 1:
      text.insert(at, bits[below(random, bits.size())]);
      return;
    case 2:
      text.erase(at, length);
      return;
    case 3:
      text.insert(at, text.substr(at, length));
      return;
    case 4:
      text.resize(at);
      return;
    default:
      for (std::size_t i = at; i < at + length; ++i) text[i] = static_cast<char>(random());
      return;
  }
}

}  // namespace

std::string Mutator::mutant(std::uint64_t seed) const {
  Random random(seed * 0x9e3779b97f4a7c15u + 1);
  std::string text = texts_[below(random, texts_.size())];
  const std::string& other = texts_[below(random, texts_.size())];
  const std::size_t changes = 1 + below(random, 1 + below(random, 4));  // every other time one
  for (std::size_t i = 0; i < changes; ++i) {
    switch (below(random, 10)) {
      case 0:
      case 1:
      case 2:
      case 3:
        change_number(text, random);
        break;
      case 4:
        change_word(text, other, random);
        break;
      case 5:
        change_shape(text, random);
        break;
      case 6:
      case 7:
        change_order(text, other, random);
        break;
      case 8:
        swap_group(text, other, random);
        break;
      default:
        change_bytes(text, random);
        break;
    }
    // Lists of lists of lists: a file of many megabytes says nothing more.
    if (text.size() > longest_text) text.resize(longest_text);
  }
  return text;
}

}  // namespace upright::testing
