#include "piece_keys.hpp"

#include <algorithm>
#include <cmath>

#include "base/angle_units.hpp"
#include "piece.hpp"

namespace upright {

namespace {

constexpr std::string_view name_characters = "abcdefghijklmnopqrstuvwxyz0123456789-_";

class KeyReader final : public PieceKeys, public YamlKeyReader {
 public:
  using YamlKeyReader::YamlKeyReader;

  void piece_map(const char* key, const VisitPiece& visit) override {
    KeyReader reader(map_.map(key));
    visit(reader);
    reader.map_.finish();
  }
  void piece_maps(const char* key, const VisitPieceItem& visit) override {
    std::size_t at = 0;
    for (const YamlMap& item : map_.maps(key)) {
      KeyReader reader(item);
      visit(reader, at++);
      item.finish();
    }
  }
  void name(const char* key, std::string& value, const std::optional<std::string>& otherwise) override {
    text(key, value, otherwise, Usual::written);
    check(key, is_plain_name(value, longest_name), "is '" + value.substr(0, 60) + "'",
          "the name is used for folders, so use at most 60 lower-case letters, digits, '-' and '_'");
  }
  void list(const char* key, std::vector<double>& values, const Range& range) override {
    values = listed(key, range);
  }
  void growing(const char* key, std::vector<double>& values, const Range& range) override {
    if (map_.is_map(key))
      values = grid(map_.map(key), range);
    else
      values = listed(key, range);
    for (std::size_t i = 1; i < values.size(); ++i)
      if (!(values[i] > values[i - 1]))
        map_.fail(key, "is not increasing", "sort the delays and list each once");
  }
  void voltage(const char* key, double& value) override { value = map_.number(key, any_voltage); }
  void voltages(const char* key, std::vector<double>& values) override { values = listed(key, any_voltage); }
  void largest_voltage(const char* key, double& value, double otherwise) override {
    value = map_.number_or(key, otherwise, any_voltage);
  }
  void angle(const char* key, double& value_rad, const Range& degrees,
             std::optional<double> otherwise_deg) override {
    number(key, value_rad, degrees, otherwise_deg, Usual::written);
    value_rad *= radians_per_degree;
  }
  void angle_or_list(const char* key, double& value_rad, std::vector<double>& values_rad,
                     const Range& degrees, double otherwise_deg) override {
    if (!map_.has(key) || !map_.is_list(key)) return angle(key, value_rad, degrees, otherwise_deg);
    for (const double angle_deg : listed(key, degrees)) values_rad.push_back(angle_deg * radians_per_degree);
  }
  void controllers(const char* key, std::vector<NamedGains>& controllers) override {
    if (!map_.has(key)) return;
    const YamlMap files = map_.map(key);
    for (const std::string& name : files.keys()) {
      if (!is_plain_name(name, longest_controller_name))
        files.fail(name, "is not a valid name for a controller",
                   "the name is used for folders, so use at most " + std::to_string(longest_controller_name) +
                       " lower-case letters, digits, '-' and '_'");
      controllers.push_back({name, files.path(name)});
    }
    files.finish();
    if (controllers.size() < 2 || controllers.size() > max_controllers)
      map_.fail(key, "has " + std::to_string(controllers.size()) + " controllers",
                "list 2 to " + std::to_string(max_controllers) + ", as {NAME: FILE, NAME: FILE}");
  }

 private:
  std::vector<double> listed(const char* key, const Range& range) const {
    std::vector<double> values = map_.numbers(key, range);
    if (values.empty() || values.size() > max_list_length)
      map_.fail(key, "has " + std::to_string(values.size()) + " numbers", "list 1 to 1000 numbers");
    return values;
  }

  static std::vector<double> grid(const YamlMap& map, const Range& range) {
    const double from = map.number("from", range), to = map.number("to", range);
    const auto count = map.integer("count", 2, static_cast<std::int64_t>(max_list_length));
    map.finish();
    std::vector<double> values;
    for (std::int64_t i = 0; i < count; ++i)
      values.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(count - 1));
    return values;
  }
};

/// Degrees whose reader gives the same radians, bit for bit where there are any.
std::string degrees_text(double rad) {
  double degrees = rad / radians_per_degree;
  for (int i = -2; i <= 2; ++i) {
    double near = degrees;
    for (int j = 0; j < std::abs(i); ++j) near = std::nextafter(near, i < 0 ? -1e9 : 1e9);
    if (near * radians_per_degree == rad) degrees = near;
  }
  const double rounded = std::round(degrees * 1e6) / 1e6;
  return exact_text(rounded * radians_per_degree == rad ? rounded : degrees);
}

class KeyWriter final : public PieceKeys, public YamlKeyWriter {
 public:
  KeyWriter() : YamlKeyWriter(Layout::one_line) {}

  void list(const char* key, std::vector<double>& values, const Range& range) override {
    numbers(key, values, range);
  }
  void growing(const char* key, std::vector<double>& values, const Range& range) override {
    numbers(key, values, range);
  }
  void voltage(const char* key, double& value) override { add(key, exact_text(value)); }
  void voltages(const char* key, std::vector<double>& values) override { numbers(key, values, any_voltage); }
  void largest_voltage(const char* key, double& value, double) override { add(key, exact_text(value)); }
  void angle(const char* key, double& value_rad, const Range&, std::optional<double>) override {
    add(key, degrees_text(value_rad));
  }
  void angle_or_list(const char* key, double& value_rad, std::vector<double>& values_rad, const Range&,
                     double) override {
    add(key, values_rad.empty() ? degrees_text(value_rad) : list_text(values_rad, degrees_text));
  }
  void controllers(const char* key, std::vector<NamedGains>& controllers) override {
    if (controllers.empty()) return;
    std::string files = "{";
    for (const NamedGains& c : controllers)
      files += (files.size() > 1 ? ", " : "") + c.name + ": " +
               yaml_quoted(std::filesystem::absolute(c.file).lexically_normal().string());
    add(key, files + "}");
  }
};

class LargestVoltage final : public PieceKeys {
 public:
  void voltage(const char* key, double& value) override { see(key, value); }
  void voltages(const char* key, std::vector<double>& values) override {
    for (const double value : values) see(key, value);
  }
  void largest_voltage(const char* key, double& value, double) override { see(key, value); }

  KeyedVoltage found;

 private:
  void see(const char* key, double value) {
    if (!found.key || value > found.voltage_v) found = {key, value};
  }
};

class Amplitude final : public PieceKeys {
 public:
  void voltage(const char* key, double& value) override { found = {key, value}; }

  KeyedVoltage found;
};

class Scaler final : public PieceKeys {
 public:
  explicit Scaler(double factor) : factor_(factor) {}
  void voltage(const char*, double& value) override { value *= factor_; }
  void voltages(const char*, std::vector<double>& values) override {
    for (double& value : values) value *= factor_;
  }

 private:
  double factor_;
};

class LimitCheck final : public PieceKeys {
 public:
  LimitCheck(double limit_v, const YamlMap& map) : limit_v_(limit_v), map_(map) {}
  void voltage(const char* key, double& value) override { judge(key, "is ", value); }
  void voltages(const char* key, std::vector<double>& values) override {
    for (const double value : values) judge(key, "goes to ", value);
  }
  void largest_voltage(const char* key, double& value, double) override { judge(key, "is ", value); }

 private:
  void judge(const char* key, const char* verb, double value) const {
    if (value > limit_v_)
      map_.fail(key, verb + exact_text(value) + ", above voltage_limit_v",
                "lower it, or raise voltage_limit_v");
  }

  double limit_v_;
  const YamlMap& map_;
};

/// A visitor may change what it visits: those that only look get a copy.
void look(const PieceKind& kind, PieceKeys& visitor) {
  kind.clone()->keys(visitor);
}

}  // namespace

void read_piece_keys(const YamlMap& map, const PieceKeys::VisitPiece& visit) {
  KeyReader reader(map);
  visit(reader);
}

std::string keys_text(const PieceKind& kind) {
  KeyWriter writer;
  look(kind, writer);
  return writer.written().empty() ? "" : ", " + writer.written();
}

KeyedVoltage largest_voltage(const PieceKind& kind) {
  LargestVoltage visitor;
  look(kind, visitor);
  return visitor.found;
}

KeyedVoltage amplitude_of(const PieceKind& kind) {
  Amplitude visitor;
  look(kind, visitor);
  return visitor.found;
}

void scale_voltages(PieceKind& kind, double factor) {
  Scaler scaler(factor);
  kind.keys(scaler);
}

void refuse_voltages_above(double limit_v, const PieceKind& kind, const YamlMap& map) {
  LimitCheck check(limit_v, map);
  look(kind, check);
}

bool is_plain_name(const std::string& name, std::size_t longest) {
  return !name.empty() && name.size() <= longest &&
         name.find_first_not_of(name_characters) == std::string::npos;
}

std::string plain_name_pattern(std::size_t longest) {
  return "^[" + std::string(name_characters.substr(0, name_characters.size() - 2)) + "_-]{1," +
         std::to_string(longest) + "}$";
}

}  // namespace upright
