#include "upright/base/yaml_reader.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <numeric>
#include <set>
#include <sstream>

#include "input_file.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

constexpr int deepest_nesting = 64;

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

/// Shows a value of the user's without control characters and not at any length.
std::string shown(const std::string& value) {
  std::string text;
  for (const char c : value.substr(0, 60)) text += (c >= 0x20 && c != 0x7f) ? c : '?';
  return value.size() > 60 ? text + "..." : text;
}

std::optional<double> parse_number(const std::string& text) {
  const char* first = text.data();
  const char* last = first + text.size();
  if (first != last && *first == '+') ++first;
  double value = 0.0;
  const auto result = std::from_chars(first, last, value);
  if (result.ec == std::errc::result_out_of_range) return std::numeric_limits<double>::infinity();
  if (result.ec != std::errc{} || result.ptr != last || first == last) {
    if (text == ".nan" || text == ".NaN" || text == ".NAN") return std::numeric_limits<double>::quiet_NaN();
    if (text == ".inf" || text == ".Inf" || text == "-.inf") return std::numeric_limits<double>::infinity();
    return std::nullopt;
  }
  return value;
}

[[noreturn]] void refuse_at(const std::filesystem::path& file, std::ptrdiff_t line, const std::string& remedy,
                            const std::string& problem) {
  throw ConfigError(file.string() + ":" + std::to_string(line) + ": " + problem + ": " + remedy);
}

/// Walks a file's events before any node is built and refuses what yaml-cpp cannot be trusted with: nesting
/// that would exhaust the stack, a second document (on some broken text yaml-cpp 0.7 finds empty documents
/// for ever), and a zero byte, with which no name or path would be read again as it was written.
class YamlEventChecker : public YAML::EventHandler {
 public:
  explicit YamlEventChecker(std::filesystem::path file) : file_(std::move(file)) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) refuse(mark, "keep only one YAML document", "a second document begins here");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    refuse(mark, "write the values out", "aliases are not supported");
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string& value) override {
    if (value.find('\0') != std::string::npos)
      refuse(mark, "write it as plain YAML text", "the file contains a zero byte");
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnMapEnd() override { --depth_; }

 private:
  void enter(const YAML::Mark& mark) {
    if (++depth_ > deepest_nesting)
      refuse(mark, "nest less deeply",
             "the nesting has more than " + std::to_string(deepest_nesting) + " levels");
  }
  [[noreturn]] void refuse(const YAML::Mark& mark, const std::string& remedy,
                           const std::string& problem) const {
    refuse_at(file_, std::max(mark.line, 0) + 1, remedy, problem);
  }

  std::filesystem::path file_;
  int documents_ = 0;
  int depth_ = 0;
};

void refuse_what_cannot_be_built(const std::string& text, const std::filesystem::path& file) {
  // yaml-cpp takes a zero byte that is not escaped for the end of a value.
  if (const std::size_t at = text.find('\0'); at != std::string::npos)
    refuse_at(file, 1 + std::count(text.data(), text.data() + at, '\n'), "write it as plain YAML text",
              "the file contains a zero byte");
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  YamlEventChecker checker(file);
  while (parser.HandleNextDocument(checker)) {
  }
}

}  // namespace

std::string exact_text(double value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  std::string text(buffer, result.ptr);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string Range::text() const {
  const bool low_finite = std::isfinite(low);
  const bool high_finite = std::isfinite(high);
  const auto brief = [](double v) {
    char buffer[32];
    return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
  };
  if (low_finite && high_finite)
    return (low_open ? "above " : "from ") + brief(low) + (low_open ? " up to " : " to ") + brief(high);
  if (low_finite) return (low_open ? "above " : "not below ") + brief(low);
  if (high_finite) return "not above " + brief(high);
  return "that is finite";
}

std::string nearest_name(std::string_view word, const std::vector<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() * 2 / 3) + 1;
  for (const std::string& name : known) {
    const std::size_t distance = edit_distance(word, name);
    if (distance < best_distance) {
      best_distance = distance;
      best = name;
    }
  }
  return best;
}

struct YamlMap::Node {
  YAML::Node yaml;
  std::filesystem::path file;
  std::string path;  // "plant.effects[2]", empty at the top
  std::set<std::string> asked;

  std::string full_key(const std::string& key) const { return path.empty() ? key : path + "." + key; }

  /// Where to point: at a plain value itself, otherwise at its key. An empty value's own mark is that of the
  /// next line, and a map's or list's that of its first entry.
  YAML::Mark mark_of(const YAML::Node& at, const std::string& key) const {
    if (at.IsDefined() && at.IsScalar() && !at.Scalar().empty()) return at.Mark();
    for (const auto& entry : yaml)
      if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.first.Mark();
    return at.IsDefined() ? at.Mark() : yaml.Mark();
  }

  [[noreturn]] void fail(const YAML::Node& at, const std::string& key, const std::string& problem,
                         const std::string& remedy) const {
    const int line = std::max(mark_of(at, key).line, 0) + 1;
    refuse_at(file, line, remedy, full_key(key) + " " + problem);
  }

  /// The node of a key, not defined when it is missing. Never inserts.
  YAML::Node find(const std::string& key) {
    asked.insert(key);
    const YAML::Node& constant = yaml;
    return constant[key];
  }

  YAML::Node require(const std::string& key, const std::string& what) {
    YAML::Node node = find(key);
    if (node.IsDefined()) return node;
    if (const YAML::Node slip = slip_for(key); slip.IsDefined())
      fail(slip, shown(slip.Scalar()), "is not a known key, and " + key + " is missing",
           "did you mean " + key + "? otherwise add " + key + " (" + what + ")");
    fail(yaml, key, "is missing", "add " + key + " (" + what + ")");
  }

  /// A key that nobody asked for and that is nearly `key`: what was meant by it.
  YAML::Node slip_for(const std::string& key) const {
    constexpr std::size_t shortest = 6;  // below it other keys are as near as slips
    const std::size_t max_distance = key.size() < shortest ? 1 : std::max<std::size_t>(2, key.size() / 4);
    for (const auto& entry : yaml)
      if (entry.first.IsScalar() && asked.count(entry.first.Scalar()) == 0 &&
          edit_distance(entry.first.Scalar(), key) <= max_distance)
        return entry.first;
    return YAML::Node(YAML::NodeType::Undefined);
  }

  double number(const YAML::Node& node, const std::string& key, const Range& range,
                const std::string& what = "a number ") const {
    const std::string remedy = "set " + key + " to " + what + range.text();
    if (!node.IsScalar()) fail(node, key, "is not a number", remedy);
    const std::optional<double> value = parse_number(node.Scalar());
    if (!value || node.Tag() == "!")
      fail(node, key, "is '" + shown(node.Scalar()) + "', which is not a number", remedy);
    if (!std::isfinite(*value)) fail(node, key, "is not finite", remedy);
    if (!range.contains(*value))
      fail(node, key, "is " + shown(node.Scalar()) + ", which is out of range", remedy);
    return *value;
  }

  std::shared_ptr<Node> child(const YAML::Node& node, const std::string& child_path) const;
};

namespace {

void refuse_bad_keys(const YAML::Node& map, const std::filesystem::path& file, const std::string& path) {
  std::set<std::string> seen;
  for (const auto& entry : map) {
    const int line = entry.first.Mark().line + 1;
    const std::string where =
        file.string() + ":" + std::to_string(line) + ": " + (path.empty() ? "" : path + ".");
    if (!entry.first.IsScalar())
      throw ConfigError(where + "a key is not a plain word: use plain words as keys");
    if (!seen.insert(entry.first.Scalar()).second)
      throw ConfigError(where + shown(entry.first.Scalar()) + " appears twice: keep one of them");
  }
}

}  // namespace

std::shared_ptr<YamlMap::Node> YamlMap::Node::child(const YAML::Node& node,
                                                    const std::string& child_path) const {
  refuse_bad_keys(node, file, child_path);
  auto made = std::make_shared<Node>();
  made->yaml.reset(node);
  made->file = file;
  made->path = child_path;
  return made;
}

YamlMap YamlMap::from_text(const std::string& text, const std::filesystem::path& file) {
  auto node = std::make_shared<Node>();
  node->file = file;
  try {
    refuse_what_cannot_be_built(text, file);
    node->yaml.reset(YAML::Load(text));
  } catch (const YAML::Exception& problem) {
    refuse_at(file, std::max(problem.mark.line, 0) + 1, "correct the YAML syntax", shown(problem.msg));
  }
  if (!node->yaml.IsMap())
    throw ConfigError(file.string() + ":1: the top level is not a map: write 'key: value' lines");
  refuse_bad_keys(node->yaml, file, "");
  return YamlMap(std::move(node));
}

YamlMap YamlMap::from_file(const std::filesystem::path& file) {
  return from_text(whole_file(file), file);
}

bool YamlMap::has(const std::string& key) const {
  return node_->find(key).IsDefined();
}

double YamlMap::number(const std::string& key, const Range& range) const {
  return node_->number(node_->require(key, "a number " + range.text()), key, range);
}

double YamlMap::number_or(const std::string& key, double fallback, const Range& range) const {
  return has(key) ? number(key, range) : fallback;
}

std::optional<double> YamlMap::optional_number(const std::string& key, const Range& range) const {
  return has(key) ? std::optional<double>(number(key, range)) : std::nullopt;
}

std::int64_t YamlMap::integer(const std::string& key, std::int64_t low, std::int64_t high) const {
  const Range range = Range::within(static_cast<double>(low), static_cast<double>(high));
  const std::string what = "a whole number " + range.text();
  const YAML::Node node = node_->require(key, what);
  const double value = node_->number(node, key, range, "a whole number ");
  if (value != std::floor(value))
    node_->fail(node, key, "is " + shown(node.Scalar()) + ", which is not a whole number",
                "set " + key + " to " + what);
  return static_cast<std::int64_t>(value);
}

std::int64_t YamlMap::integer_or(const std::string& key, std::int64_t fallback, std::int64_t low,
                                 std::int64_t high) const {
  return has(key) ? integer(key, low, high) : fallback;
}

bool YamlMap::flag_or(const std::string& key, bool fallback) const {
  const YAML::Node node = node_->find(key);
  if (!node.IsDefined()) return fallback;
  if (node.IsScalar() && node.Scalar() == "true") return true;
  if (node.IsScalar() && node.Scalar() == "false") return false;
  node_->fail(node, key, "is neither true nor false", "set " + key + " to true or false");
}

std::string YamlMap::text(const std::string& key) const {
  const YAML::Node node = node_->require(key, "text");
  if (!node.IsScalar() || node.Scalar().empty())
    node_->fail(node, key, "is not text", "set " + key + " to text");
  return node.Scalar();
}

std::string YamlMap::text_or(const std::string& key, const std::string& fallback) const {
  const YAML::Node node = node_->find(key);
  if (!node.IsDefined()) return fallback;
  if (!node.IsScalar()) node_->fail(node, key, "is not text", "set " + key + " to text");
  return node.Scalar();
}

std::string YamlMap::choice(const std::string& key, const std::vector<std::string>& names) const {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  const YAML::Node node = node_->require(key, "one of " + list);
  std::string value = node.IsScalar() ? node.Scalar() : "";
  if (std::find(names.begin(), names.end(), value) != names.end()) return value;
  const std::string near = nearest_name(value, names);
  node_->fail(node, key, "is '" + shown(value) + "', which is not a known value",
              near.empty() ? "use one of " + list : "did you mean " + near + "? use one of " + list);
}

std::vector<double> YamlMap::numbers(const std::string& key, const Range& range) const {
  const YAML::Node node = node_->require(key, "a list of numbers");
  if (!node.IsSequence()) node_->fail(node, key, "is not a list", "set " + key + " to a list of numbers");
  std::vector<double> values;
  for (const auto& item : node) values.push_back(node_->number(item, key, range));
  return values;
}

YamlMap YamlMap::map(const std::string& key) const {
  const YAML::Node node = node_->require(key, "a map");
  if (!node.IsMap())
    node_->fail(node, key, "is not a map", "write " + key + " as a map of 'key: value' pairs");
  return YamlMap(node_->child(node, node_->full_key(key)));
}

std::optional<YamlMap> YamlMap::optional_map(const std::string& key) const {
  return has(key) ? std::optional<YamlMap>(map(key)) : std::nullopt;
}

std::vector<YamlMap> YamlMap::maps(const std::string& key) const {
  const YAML::Node node = node_->require(key, "a list of maps");
  if (!node.IsSequence()) node_->fail(node, key, "is not a list", "write " + key + " as a list");
  std::vector<YamlMap> result;
  for (std::size_t i = 0; i < node.size(); ++i) {
    const YAML::Node item = node[i];
    const std::string path = node_->full_key(key) + "[" + std::to_string(i) + "]";
    if (!item.IsMap())
      node_->fail(item, key + "[" + std::to_string(i) + "]", "is not a map",
                  "write each item as {key: value}");
    result.push_back(YamlMap(node_->child(item, path)));
  }
  return result;
}

bool YamlMap::is_scalar(const std::string& key) const {
  const YAML::Node node = node_->find(key);
  return node.IsDefined() && node.IsScalar();
}

bool YamlMap::is_map(const std::string& key) const {
  const YAML::Node node = node_->find(key);
  return node.IsDefined() && node.IsMap();
}

bool YamlMap::is_list(const std::string& key) const {
  const YAML::Node node = node_->find(key);
  return node.IsDefined() && node.IsSequence();
}

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> names;
  for (const auto& entry : node_->yaml) names.push_back(entry.first.Scalar());
  return names;
}

void YamlMap::finish() const {
  for (const auto& entry : node_->yaml) {
    const std::string key = entry.first.Scalar();
    if (node_->asked.count(key) != 0) continue;
    const std::vector<std::string> known(node_->asked.begin(), node_->asked.end());
    const std::string near = nearest_name(key, known);
    node_->fail(entry.first, shown(key), "is not a known key",
                near.empty() ? "remove it" : "did you mean " + near + "? otherwise remove it");
  }
}

void YamlMap::fail(const std::string& key, const std::string& problem, const std::string& remedy) const {
  const YAML::Node node = node_->find(key);
  node_->fail(node.IsDefined() ? node : node_->yaml, key, problem, remedy);
}

const std::filesystem::path& YamlMap::file() const {
  return node_->file;
}

std::filesystem::path YamlMap::path(const std::string& key) const {
  const std::filesystem::path given = text(key);
  return given.is_absolute() ? given : (node_->file.parent_path() / given).lexically_normal();
}

std::string yaml_quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') result += '\'';
    const bool control = static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
    result += control ? ' ' : c;
  }
  return result + "'";
}

}  // namespace upright
