// `upright effects`: every effect the plant model knows, from the registry.
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "json_number.hpp"
#include "upright/model/registry.hpp"

namespace upright::cli {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const ParameterInfo& parameter) {
  Json json = {{"name", parameter.name},
               {"unit", parameter.unit},
               {"minimum", finite_or_null(parameter.range.low)},
               {"maximum", finite_or_null(parameter.range.high)},
               {"minimum_excluded", parameter.range.low_open},
               {"neutral", finite_or_null(parameter.neutral)},
               {"typical", finite_or_null(parameter.typical)},
               {"meaning", parameter.meaning}};
  if (!parameter.words.empty()) json["words"] = parameter.words;
  return json;
}

/// Which values are allowed.
std::string values_of(const ParameterInfo& parameter) {
  std::string words;
  for (const std::string_view word : parameter.words)
    words += (words.empty() ? "" : ", ") + std::string(word);
  if (!words.empty()) return words;
  const bool bounded = std::isfinite(parameter.range.low) || std::isfinite(parameter.range.high);
  return bounded ? parameter.range.text() : "any value";
}

Json json_of(const EffectInfo& effect) {
  Json parameters = Json::array();
  for (const ParameterInfo& parameter : effect.parameters) parameters.push_back(json_of(parameter));
  return {{"kind", effect.kind},         {"enters", name_of(effect.enters)}, {"dry", effect.dry},
          {"equation", effect.equation}, {"meaning", effect.meaning},        {"parameters", parameters}};
}

void print(const EffectInfo& effect) {
  std::cout << effect.kind << "  (" << name_of(effect.enters) << (effect.dry ? ", dry" : "") << ")\n  "
            << effect.meaning << "\n  " << effect.equation << "\n";
  for (const ParameterInfo& parameter : effect.parameters) {
    std::cout << "    " << parameter.name;
    if (!parameter.unit.empty()) std::cout << " [" << parameter.unit << "]";
    std::cout << ", " << values_of(parameter) << ": " << parameter.meaning << "\n";
  }
  std::cout << "\n";
}

/// One effect, or all when `only` is empty.
void print_effects(const std::string& only, bool as_json) {
  Json list = Json::array();
  for (const EffectInfo& effect : effect_registry()) {
    if (!only.empty() && effect.kind != only) continue;
    if (as_json)
      list.push_back(json_of(effect));
    else
      print(effect);
  }
  if (as_json) std::cout << Json{{"effects", list}}.dump(2) << "\n";
}

std::string fault_of_kind(const std::string& kind) {
  if (effect_number(kind) < effect_count) return "";
  std::vector<std::string> kinds;
  for (const EffectInfo& info : effect_registry()) kinds.emplace_back(info.kind);
  const std::string near = nearest_name(kind, kinds);
  return "there is no effect '" + kind.substr(0, 80) + "'" +
         (near.empty() ? "" : ", did you mean " + near + "?");
}

}  // namespace

void add_effects(CommandLine& line) {
  const Command command = line.command("effects", "List every effect that a plant file can contain",
                                       "Examples:\n"
                                       "  upright effects --json\n"
                                       "  upright effects coulomb_friction");
  const auto only = std::make_shared<std::string>();
  const auto as_json = std::make_shared<bool>(false);
  command.option("effect", *only, "Kind of one effect (default: all)").without(fault_of_kind);
  command.flag("--json", *as_json, "Print one JSON document");
  command.does([only, as_json] {
    print_effects(*only, *as_json);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
