#include "yaml_keys.hpp"

#include <algorithm>

namespace upright {

namespace {

/// A text in double quotes, as YAML reads it back.
std::string double_quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + "\"";
}

}  // namespace

void YamlKeyReader::number(const char* key, double& value, const Range& range,
                           std::optional<double> otherwise, Usual) {
  value = otherwise ? map_.number_or(key, *otherwise, range) : map_.number(key, range);
}

void YamlKeyReader::numbers(const char* key, std::vector<double>& values, const Range& range) {
  values = map_.numbers(key, range);
}

void YamlKeyReader::flag(const char* key, bool& value, bool otherwise, Usual) {
  value = map_.flag_or(key, otherwise);
}

void YamlKeyReader::text(const char* key, std::string& value, const std::optional<std::string>& otherwise,
                         Usual) {
  value = otherwise ? map_.text_or(key, *otherwise) : map_.text(key);
}

void YamlKeyReader::texts(const char* key, std::map<std::string, std::string>& values) {
  const YamlMap texts = map_.map(key);
  for (const std::string& name : texts.keys()) values[name] = texts.text(name);
}

void YamlKeyReader::path(const char* key, std::filesystem::path& value) {
  value = map_.path(key);
}

void YamlKeyReader::map(const char* key, const Visit& visit) {
  YamlKeyReader reader(map_.map(key));
  visit(reader);
  reader.map_.finish();
}

void YamlKeyReader::maps(const char* key, std::size_t, const VisitItem& visit) {
  std::size_t at = 0;
  for (const YamlMap& item : map_.maps(key)) {
    YamlKeyReader reader(item);
    visit(reader, at++);
    item.finish();
  }
}

bool YamlKeyReader::given(const char* key, bool) {
  return map_.has(key);
}

bool YamlKeyReader::is_map(const char* key, bool) {
  return map_.is_map(key);
}

void YamlKeyReader::whole_number(const char* key, std::int64_t& value, std::int64_t low, std::int64_t high,
                                 std::optional<std::int64_t> otherwise) {
  value = otherwise ? map_.integer_or(key, *otherwise, low, high) : map_.integer(key, low, high);
}

void YamlKeyReader::choice(const char* key, std::size_t& word, const std::vector<std::string>& words,
                           std::optional<std::size_t> otherwise) {
  word = otherwise && !map_.has(key)
             ? *otherwise
             : static_cast<std::size_t>(std::find(words.begin(), words.end(), map_.choice(key, words)) -
                                        words.begin());
}

void YamlKeyWriter::number(const char* key, double& value, const Range&, std::optional<double> otherwise,
                           Usual usual) {
  if (usual == Usual::written || value != otherwise) add(key, exact_text(value));
}

void YamlKeyWriter::numbers(const char* key, std::vector<double>& values, const Range&) {
  add(key, list_text(values, exact_text));
}

void YamlKeyWriter::flag(const char* key, bool& value, bool otherwise, Usual usual) {
  if (usual == Usual::written || value != otherwise) add(key, value ? "true" : "false");
}

void YamlKeyWriter::text(const char* key, std::string& value, const std::optional<std::string>& otherwise,
                         Usual usual) {
  if (usual == Usual::written || value != otherwise) add(key, double_quoted(value));
}

void YamlKeyWriter::path(const char* key, std::filesystem::path& value) {
  add(key, double_quoted(value.string()));
}

void YamlKeyWriter::map(const char* key, const Visit& visit) {
  YamlKeyWriter writer(Layout::one_line);
  visit(writer);
  add(key, "{" + writer.written() + "}");
}

void YamlKeyWriter::section(const char* key, const Visit& visit) {
  if (layout_ == Layout::one_line) return map(key, visit);
  YamlKeyWriter writer(Layout::lines, indent_.size() + 2);
  visit(writer);
  written_ += indent_ + key + ":\n" + writer.written();
}

void YamlKeyWriter::maps(const char* key, std::size_t count, const VisitItem& visit) {
  std::vector<std::string> texts;
  for (std::size_t at = 0; at < count; ++at) {
    YamlKeyWriter writer(Layout::one_line);
    visit(writer, at);
    texts.push_back("{" + writer.written() + "}");
  }
  std::string list;
  if (layout_ == Layout::lines) {
    for (const std::string& text : texts) list += indent_ + "  - " + text + "\n";
    written_ += indent_ + key + (texts.empty() ? ": []\n" : ":\n") + list;
    return;
  }
  for (const std::string& text : texts) list += (list.empty() ? "" : ", ") + text;
  add(key, "[" + list + "]");
}

void YamlKeyWriter::whole_number(const char* key, std::int64_t& value, std::int64_t, std::int64_t,
                                 std::optional<std::int64_t>) {
  add(key, std::to_string(value));
}

void YamlKeyWriter::choice(const char* key, std::size_t& word, const std::vector<std::string>& words,
                           std::optional<std::size_t>) {
  add(key, words[word]);
}

void YamlKeyWriter::add(const char* key, const std::string& value) {
  if (layout_ == Layout::lines)
    written_ += indent_ + key + ": " + value + "\n";
  else
    written_ += (written_.empty() ? "" : ", ") + std::string(key) + ": " + value;
}

}  // namespace upright
