#include "schema_keys.hpp"

#include <cmath>

#include "object_schema.hpp"

namespace upright {

namespace {

/// What reads as a text: a plain scalar may look like a number or a flag.
Json text_schema(std::size_t min_length) {
  Json schema = {{"type", {"string", "number", "boolean"}}};
  if (min_length > 0) schema["minLength"] = min_length;
  return schema;
}

Json number_schema(const Range& range) {
  Json schema = {{"type", "number"}};
  if (std::isfinite(range.low)) schema[range.low_open ? "exclusiveMinimum" : "minimum"] = range.low;
  if (std::isfinite(range.high)) schema["maximum"] = range.high;
  return schema;
}

Json list_schema(const Json& items, std::size_t min_items, std::size_t max_items) {
  return {{"type", "array"}, {"items", items}, {"minItems", min_items}, {"maxItems", max_items}};
}

/// Goes one way through a list of keys. With a value that others depend on it goes on as `Way` decides.
class SchemaKeys final : public PieceKeys {
 public:
  SchemaKeys(Way& way, WayEnd& end) : way_(way), end_(&end) {}
  /// Of a map whose own schema is known: for what others depend on.
  SchemaKeys(Way& way, std::vector<std::string> maps) : way_(way), maps_(std::move(maps)) {}

  void number(const char* key, double&, const Range& range, std::optional<double> otherwise, Usual) override {
    Json schema = number_schema(range);
    if (otherwise && range.contains(*otherwise)) schema["default"] = *otherwise;
    define(key, schema, !otherwise);
  }
  void numbers(const char* key, std::vector<double>&, const Range& range) override {
    define(key, {{"type", "array"}, {"items", number_schema(range)}}, true);
  }
  void flag(const char* key, bool& value, bool otherwise, Usual) override {
    define(key, {{"type", "boolean"}, {"default", otherwise}}, false);
    value = decide_value(key, {false, true}, otherwise ? 1 : 0) == 1;
  }
  void text(const char* key, std::string& value, const std::optional<std::string>& otherwise,
            Usual) override {
    define(key, text_schema(otherwise ? 0 : 1), !otherwise);
    value = "text";
  }
  void texts(const char* key, std::map<std::string, std::string>&) override {
    define(key, {{"type", "object"}, {"additionalProperties", text_schema(1)}}, true);
  }
  void path(const char* key, std::filesystem::path& value) override {
    define(key, text_schema(1), true);
    value = "file";
  }
  void map(const char* key, const Visit& visit) override {
    define_map(key, [&visit](PieceKeys& keys) { visit(keys); });
  }
  void deciding_map(const char* key, const Visit& visit) override {
    map(key, visit);
    std::vector<std::string> maps = maps_;
    maps.emplace_back(key);
    SchemaKeys inside(way_, maps);
    visit(inside);
  }
  bool given(const char* key, bool) override {
    given_.insert(key);
    return true;
  }
  bool decides_by_presence(const char* key, bool) override {
    return decide(key, Decision::About::presence) == Decision::yes;
  }
  bool decides_by_pattern(const char* key, const std::string& pattern, bool) override {
    return decide(key, Decision::About::pattern, pattern) == Decision::yes;
  }
  bool is_map(const char* key, bool) override {
    return decide(key, Decision::About::is_map) == Decision::yes;
  }
  void require_any(const std::vector<std::string>& keys) override {
    if (end_) end_->any_of.push_back(keys);
  }
  void describe(const char* key, const std::string& meaning) override {
    if (Property* property = find(key)) property->schema["description"] = meaning;
  }

  void piece_map(const char* key, const VisitPiece& visit) override { define_map(key, visit); }
  void piece_maps(const char* key, const VisitPieceItem& visit) override {
    const Json item = schema_of([&visit](PieceKeys& keys) { visit(keys, 0); });
    define(key, {{"type", "array"}, {"items", item}}, true);
  }
  void name(const char* key, std::string& value, const std::optional<std::string>& otherwise) override {
    define(key, name_schema(longest_name), !otherwise);
    value = "name";
  }
  void list(const char* key, std::vector<double>&, const Range& range) override {
    define(key, list_schema(number_schema(range), 1, max_list_length), true);
  }
  void growing(const char* key, std::vector<double>&, const Range& range) override {
    const Json grid = schema_of([&range](PieceKeys& keys) {
      double from = 0.0, to = 0.0;
      std::int64_t count = 0;
      keys.number("from", from, range);
      keys.number("to", to, range);
      keys.integer("count", count, 2, static_cast<std::int64_t>(max_list_length));
    });
    define(key, {{"anyOf", {list_schema(number_schema(range), 1, max_list_length), grid}}}, true);
  }
  void voltage(const char* key, double&) override { define(key, number_schema(any_voltage), true); }
  void voltages(const char* key, std::vector<double>& values) override { list(key, values, any_voltage); }
  void largest_voltage(const char* key, double& value, double otherwise) override {
    number(key, value, any_voltage, otherwise, Usual::written);
  }
  void angle(const char* key, double& value_rad, const Range& degrees,
             std::optional<double> otherwise_deg) override {
    number(key, value_rad, degrees, otherwise_deg, Usual::written);
  }
  void angle_or_list(const char* key, double&, std::vector<double>&, const Range& degrees,
                     double otherwise_deg) override {
    const Json angle = number_schema(degrees);
    define(key, {{"anyOf", {angle, list_schema(angle, 1, max_list_length)}}, {"default", otherwise_deg}},
           false);
  }
  void controllers(const char* key, std::vector<NamedGains>& controllers) override {
    controllers.clear();
    if (!decides_by_presence(key, true)) return;
    define(key,
           {{"type", "object"},
            {"propertyNames", {{"pattern", plain_name_pattern(longest_controller_name)}}},
            {"additionalProperties", text_schema(1)},
            {"minProperties", 2},
            {"maxProperties", max_controllers}},
           true);
    controllers.resize(2);
  }

 protected:
  void whole_number(const char* key, std::int64_t& value, std::int64_t low, std::int64_t high,
                    std::optional<std::int64_t> otherwise) override {
    Json schema = {{"type", "integer"}, {"minimum", low}, {"maximum", high}};
    if (otherwise) schema["default"] = *otherwise;
    define(key, schema, !otherwise);
    value = high;  // the widest counter
    if (high - low != 1) return;
    const auto usual = otherwise ? std::optional(static_cast<std::size_t>(*otherwise - low)) : std::nullopt;
    value = low + static_cast<std::int64_t>(decide_value(key, {low, high}, usual));
  }
  void choice(const char* key, std::size_t& word, const std::vector<std::string>& words,
              std::optional<std::size_t> otherwise) override {
    Json schema = {{"enum", words}};
    if (otherwise) schema["default"] = words.at(*otherwise);
    define(key, schema, !otherwise);
    word = decide_value(key, {words.begin(), words.end()}, otherwise);
  }
  void maps(const char* key, std::size_t, const VisitItem& visit) override {
    piece_maps(key, [&visit](PieceKeys& keys, std::size_t at) { visit(keys, at); });
  }
  bool visits_unset() const override { return true; }

  void admit(const char* key, const Admitted& admitted) override {
    Property* property = find(key);
    if (!property) return;
    Json& schema = property->schema;
    if (admitted.min_items) schema["minItems"] = *admitted.min_items;
    if (admitted.max_items) schema["maxItems"] = *admitted.max_items;
    if (admitted.not_zero) schema["not"] = {{"const", 0}};
    if (admitted.min && admitted.zero_too) schema["anyOf"] = {{{"const", 0}}, {{"minimum", *admitted.min}}};
    if (admitted.min && !admitted.zero_too) schema["minimum"] = *admitted.min;
    if (admitted.max_length > 0) schema["maxLength"] = admitted.max_length;
    if (!admitted.pattern.empty()) {
      schema["type"] = "string";
      schema["pattern"] = admitted.pattern;
    }
  }
  void forbid(const std::string& reason) override { throw RefusedWay{&way_, reason}; }

 private:
  static Json name_schema(std::size_t longest) {
    Json schema = text_schema(0);
    schema["pattern"] = plain_name_pattern(longest);
    return schema;
  }

  Property* find(const char* key) { return end_ ? end_->find(key) : nullptr; }
  void define(const char* key, const Json& schema, bool is_required) {
    if (!end_ && is_required && way_.decided_absent(maps_, key))
      throw RefusedWay{&way_, std::string(key) + " is missing"};
    if (end_) end_->properties.push_back({key, schema, is_required && given_.count(key) == 0});
  }
  void define_map(const char* key, const VisitPiece& visit) {
    if (end_) define(key, schema_of(visit), true);
  }

  std::size_t decide(const char* key, Decision::About about, const std::string& pattern = "") {
    Decision decision;
    decision.about = about;
    decision.maps = maps_;
    decision.key = key;
    decision.pattern = pattern;
    return way_.decide(decision);
  }
  std::size_t decide_value(const char* key, const std::vector<Json>& values,
                           std::optional<std::size_t> otherwise) {
    Decision decision;
    decision.about = Decision::About::value;
    decision.maps = maps_;
    decision.key = key;
    decision.values = values;
    decision.otherwise = otherwise;
    return way_.decide(decision);
  }

  Way& way_;
  WayEnd* end_ = nullptr;
  std::vector<std::string> maps_;
  std::set<std::string> given_;
};

}  // namespace

Json schema_of(const PieceKeys::VisitPiece& visit) {
  const auto ways = explore([&visit](Way& way, WayEnd& end) {
    SchemaKeys keys(way, end);
    visit(keys);
  });
  return object_schema(*ways);
}

}  // namespace upright
