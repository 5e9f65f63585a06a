#include "file_schemas.hpp"

#include <array>
#include <map>
#include <set>

#include "control/gain_keys.hpp"
#include "experiment/experiment_file.hpp"
#include "hal/rig_keys.hpp"
#include "measurement/dataset_file.hpp"
#include "model/plant_keys.hpp"
#include "schema_keys.hpp"
#include "sweep/sweep.hpp"

namespace upright {

namespace {

/// Parts that occur more than once, for `definitions`.
class SharedParts {
 public:
  explicit SharedParts(Json& root) {
    count(root);
    replace_inside(root);
    if (!definitions_.empty()) root["definitions"] = definitions_;
  }

 private:
  static constexpr std::size_t worth_a_name = 200;  // characters

  static bool is_large_map(const Json& part, const std::string& text) {
    return part.is_object() && part.value("type", Json()) == "object" && text.size() >= worth_a_name;
  }
  void count(const Json& part) {
    if (const std::string text = part.dump(); is_large_map(part, text)) ++counts_[text];
    if (part.is_structured())
      for (const Json& inner : part) count(inner);
  }
  void replace_inside(Json& part, bool are_properties = false) {
    for (const auto& [key, inner] : part.items()) {
      if (are_properties) name_ = key;
      replace(inner, part.is_object() && !are_properties && key == "properties");
    }
  }
  void replace(Json& part, bool are_properties) {
    if (!part.is_structured()) return;
    const std::string text = part.dump();
    if (!is_large_map(part, text) || counts_[text] < 2) return replace_inside(part, are_properties);
    auto [known, is_new] = names_.try_emplace(text, "");
    if (is_new) {
      known->second = free_name(name_);
      replace_inside(part);
      definitions_[known->second] = part;
    }
    part = {{"$ref", "#/definitions/" + known->second}};
  }
  std::string free_name(const std::string& wanted) {
    std::string name = wanted;
    for (int i = 2; !taken_.insert(name).second; ++i) name = wanted + "-" + std::to_string(i);
    return name;
  }

  std::map<std::string, int> counts_;
  std::map<std::string, std::string> names_;
  std::set<std::string> taken_;
  std::string name_ = "part";  ///< the key above
  Json definitions_;
};

/// As people write JSON: what fits stands on one line.
std::string printed(const Json& part, std::size_t indent) {
  constexpr std::size_t line = 110;
  const std::string brief = part.dump(-1);
  if (!part.is_structured() || part.empty() || indent + brief.size() <= line) return brief;
  const std::string margin(indent + 1, ' ');
  std::string text;
  for (const auto& [key, inner] : part.items())
    text += (text.empty() ? "\n" : ",\n") + margin + (part.is_object() ? Json(key).dump() + ": " : "") +
            printed(inner, indent + 1);
  const char* brackets = part.is_object() ? "{}" : "[]";
  return brackets[0] + text + "\n" + std::string(indent, ' ') + brackets[1];
}

/// The schema of files that are read into a `File` by these keys.
template <class File, class Keys>
std::string schema_text(const char* title, void (*visit)(Keys&, File&)) {
  Json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", title}};
  schema.update(schema_of([visit](PieceKeys& keys) {
    File file;
    visit(keys, file);
  }));
  const SharedParts shared(schema);
  return printed(schema, 0) + "\n";
}

constexpr std::array all_schemas = {
    FileSchema{"rig", [] { return schema_text<RigFile>("rig file of upright", rig_keys); }},
    FileSchema{"gains", [] { return schema_text<ControlConfig>("gain file of upright", gain_keys); }},
    FileSchema{"plant", [] { return schema_text<PlantFile>("plant file of upright", plant_file_keys); }},
    FileSchema{"sweep",
               [] { return schema_text<SweepConfig, YamlKeys>("sweep file of upright", sweep_keys); }},
    FileSchema{"experiment",
               [] { return schema_text<Experiment>("experiment file of upright", experiment_keys); }},
    FileSchema{"dataset", [] { return schema_text<Dataset>("dataset file of upright", dataset_keys); }},
};

}  // namespace

std::span<const FileSchema> file_schemas() {
  return all_schemas;
}

}  // namespace upright
