#include "object_schema.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace upright {

namespace {

/// What the ways demand of one key, or whether they are refused: a tree in which decisions without influence
/// are left out.
struct Demand {
  enum class Kind : std::uint8_t { refused, absent, optional, required, depends };
  Kind kind = Kind::absent;
  Json schema;        ///< of an optional or required key
  Decision decision;  ///< where it depends on one
  std::vector<std::shared_ptr<const Demand>> children;
  std::string id;  ///< the same for equal ones
};
using DemandPtr = std::shared_ptr<const Demand>;

/// Short names for texts, so that trees compare quickly.
class Names {
 public:
  std::string of(const std::string& text) {
    return std::to_string(names_.try_emplace(text, names_.size()).first->second);
  }

 private:
  std::map<std::string, std::size_t> names_;
};

class Demands {
 public:
  explicit Demands(std::string key) : key_(std::move(key)) {}

  DemandPtr of(const Branch& branch) {
    if (!branch.decision) return of_end(branch.end);
    std::vector<DemandPtr> children;
    for (const auto& child : branch.children) children.push_back(of(*child));
    return joined(*branch.decision, std::move(children));
  }

 private:
  using Kind = Demand::Kind;

  DemandPtr of_end(const WayEnd& end) {
    if (!end.refusal.empty()) return leaf(Kind::refused, {});
    for (const Property& property : end.properties)
      if (property.key == key_)
        return leaf(property.is_required ? Kind::required : Kind::optional, property.schema);
    return leaf(Kind::absent, {});
  }

  DemandPtr leaf(Kind kind, const Json& schema) {
    Demand demand;
    demand.kind = kind;
    demand.schema = schema;
    demand.id = names_.of(std::to_string(static_cast<int>(kind)) + schema.dump());
    return std::make_shared<const Demand>(std::move(demand));
  }

  static bool has_schema(const Demand& demand) {
    return demand.kind == Kind::optional || demand.kind == Kind::required;
  }

  /// The decision is whether the key itself is there. Null: it is not as simple as that.
  DemandPtr of_presence(const Demand& there, const Demand& not_there) {
    if (there.kind == Kind::depends || not_there.kind == Kind::depends) return nullptr;
    if (!has_schema(there)) return leaf(Kind::absent, {});
    const bool must_be = not_there.kind == Kind::required || not_there.kind == Kind::refused;
    return leaf(must_be ? Kind::required : Kind::optional, there.schema);
  }

  DemandPtr joined(const Decision& decision, std::vector<DemandPtr> children) {
    if (decision.is_about(Decision::About::presence, key_))
      if (DemandPtr demand = of_presence(*children[Decision::yes], *children[Decision::no])) return demand;
    const bool either = decision.is_about(Decision::About::is_map, key_) && has_schema(*children[0]) &&
                        has_schema(*children[1]);
    if (either) return leaf(children[0]->kind, {{"anyOf", {children[0]->schema, children[1]->schema}}});
    std::set<std::string> ids;
    DemandPtr last = children.front();
    for (const DemandPtr& child : children)
      if (child->kind != Kind::refused) {
        ids.insert(child->id);
        last = child;
      }
    if (ids.size() <= 1) return last;
    Demand demand;
    demand.kind = Kind::depends;
    std::string text = "depends " + decision.key;
    for (const std::string& map : decision.maps) text += " " + map;
    for (const DemandPtr& child : children) text += " " + child->id;
    demand.id = names_.of(text);
    demand.decision = decision;
    demand.children = std::move(children);
    return std::make_shared<const Demand>(std::move(demand));
  }

  std::string key_;
  Names names_;
};

Json within_maps(const Decision& decision, Json condition) {
  for (auto map = decision.maps.rbegin(); map != decision.maps.rend(); ++map)
    condition = {{"properties", {{*map, std::move(condition)}}}, {"required", {*map}}};
  return condition;
}

Json with_key(const std::string& key, const Json& schema) {
  return {{"properties", {{key, schema}}}, {"required", {key}}};
}

Json value_condition(const Decision& decision, const std::vector<std::size_t>& outcomes) {
  Json in = Json::array(), out = Json::array();
  for (std::size_t i = 0; i < decision.values.size(); ++i)
    (std::find(outcomes.begin(), outcomes.end(), i) != outcomes.end() ? in : out)
        .push_back(decision.values[i]);
  const Json schema = in.size() == 1                ? Json{{"const", in[0]}}
                      : in.size() <= 1 + out.size() ? Json{{"enum", in}}
                                                    : Json{{"not", {{"enum", out}}}};
  const bool may_be_absent = decision.otherwise && std::find(outcomes.begin(), outcomes.end(),
                                                             *decision.otherwise) != outcomes.end();
  if (may_be_absent) return {{"properties", {{decision.key, schema}}}};
  return with_key(decision.key, schema);
}

/// A schema of the object that holds for these outcomes of a decision.
Json condition_of(const Decision& decision, const std::vector<std::size_t>& outcomes) {
  if (decision.about == Decision::About::value)
    return within_maps(decision, value_condition(decision, outcomes));
  Json condition;
  if (decision.about == Decision::About::presence) condition = {{"required", {decision.key}}};
  if (decision.about == Decision::About::is_map) condition = with_key(decision.key, {{"type", "object"}});
  if (decision.about == Decision::About::pattern)
    condition = with_key(decision.key, {{"pattern", decision.pattern}});
  if (outcomes.front() == Decision::no) condition = Json{{"not", condition}};
  return within_maps(decision, condition);
}

/// Outcomes with the same demand, few before many; refused ones go with the many.
struct Group {
  std::vector<std::size_t> outcomes;
  DemandPtr demand;
};

std::vector<Group> groups_of(const Demand& demand) {
  std::vector<Group> groups;
  for (std::size_t i = 0; i < demand.children.size(); ++i) {
    const DemandPtr& child = demand.children[i];
    if (child->kind == Demand::Kind::refused) continue;
    const auto at = std::find_if(groups.begin(), groups.end(),
                                 [&child](const Group& group) { return group.demand->id == child->id; });
    if (at == groups.end())
      groups.push_back({{i}, child});
    else
      at->outcomes.push_back(i);
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const Group& a, const Group& b) { return a.outcomes.size() < b.outcomes.size(); });
  return groups;
}

void merge(Json& into, const Json& rules);

/// Adds a rule to others. Rules with the same condition become one.
void add_rule(Json& rules, const Json& rule) {
  if (rule.contains("if"))
    for (Json& known : rules)
      if (known.contains("if") && known["if"] == rule["if"]) {
        for (const char* part : {"then", "else"})
          if (rule.contains(part)) merge(known[part], rule[part]);
        return;
      }
  rules.push_back(rule);
}

/// Makes `into` demand what `other` does, besides.
void merge(Json& into, const Json& other) {
  if (other.is_null()) return;
  if (into.is_null()) {
    into = other;
    return;
  }
  if (into.contains("not") || other.contains("not")) {  // a refusal stands alone
    into = {{"allOf", {into, other}}};
    return;
  }
  if (other.contains("properties"))
    for (const auto& [key, schema] : other["properties"].items()) into["properties"][key] = schema;
  if (other.contains("required"))
    for (const Json& key : other["required"]) into["required"].push_back(key);
  if (other.contains("allOf"))
    for (const Json& rule : other["allOf"]) {
      if (!into.contains("allOf")) into["allOf"] = Json::array();
      add_rule(into["allOf"], rule);
    }
}

/// What an end of the tree says; null: nothing.
using LeafRule = std::function<Json(const Demand&)>;

Json rule_of(const Demand& demand, const LeafRule& leaf_rule) {
  if (demand.kind != Demand::Kind::depends) return leaf_rule(demand);
  const std::vector<Group> groups = groups_of(demand);
  Json rule = rule_of(*groups.back().demand, leaf_rule);
  for (std::size_t i = groups.size() - 1; i-- > 0;) {
    Json test = {{"if", condition_of(demand.decision, groups[i].outcomes)}};
    if (const Json then = rule_of(*groups[i].demand, leaf_rule); !then.is_null()) test["then"] = then;
    if (!rule.is_null()) test["else"] = rule;
    rule = test.size() > 1 ? Json{{"allOf", Json::array({test})}} : Json();
  }
  return rule;
}

void collect_schemas(const Demand& demand, std::vector<Json>& schemas) {
  for (const DemandPtr& child : demand.children) collect_schemas(*child, schemas);
  const bool has_schema = demand.kind == Demand::Kind::optional || demand.kind == Demand::Kind::required;
  if (has_schema && std::find(schemas.begin(), schemas.end(), demand.schema) == schemas.end())
    schemas.push_back(demand.schema);
}

/// Adds what the ways demand of one key.
void add_property(Json& object, const std::string& key, const Demand& demand) {
  std::vector<Json> schemas;
  collect_schemas(demand, schemas);
  if (schemas.empty()) return;  // every way with this key is refused
  const bool several = schemas.size() > 1;
  object["properties"][key] = several ? Json{{"anyOf", schemas}} : schemas.front();
  merge(object, rule_of(demand, [&](const Demand& end) {
          Json rule;
          if (end.kind == Demand::Kind::required) rule["required"] = {key};
          if (end.kind == Demand::Kind::absent) rule["properties"][key] = false;
          if (several && end.kind != Demand::Kind::absent) rule["properties"][key] = end.schema;
          return rule;
        }));
}

/// The tree of refusals as demands: `required` where a way is refused, with the reason as its schema.
std::unique_ptr<Branch> refusals_of(const Branch& branch) {
  auto copy = std::make_unique<Branch>();
  copy->decision = branch.decision;
  for (const auto& child : branch.children) copy->children.push_back(refusals_of(*child));
  if (!branch.end.refusal.empty()) copy->end.properties.push_back({"", branch.end.refusal, true});
  return copy;
}

void add_refusals(Json& object, const Branch& ways) {
  const DemandPtr demand = Demands("").of(*refusals_of(ways));
  const Json rule = rule_of(*demand, [](const Demand& end) {
    if (end.kind != Demand::Kind::required) return Json();
    return Json{{"not", Json::object()}, {"errorMessage", end.schema}};
  });
  merge(object, rule);
}

void collect_keys(const Branch& branch, std::vector<std::string>& keys,
                  std::vector<std::vector<std::string>>& any_of) {
  for (const Property& property : branch.end.properties)
    if (std::find(keys.begin(), keys.end(), property.key) == keys.end()) keys.push_back(property.key);
  for (const auto& list : branch.end.any_of)
    if (std::find(any_of.begin(), any_of.end(), list) == any_of.end()) any_of.push_back(list);
  for (const auto& child : branch.children) collect_keys(*child, keys, any_of);
}

std::vector<std::string> keys_of(const Branch& ways) {
  std::vector<std::string> keys;
  std::vector<std::vector<std::string>> any_of;
  collect_keys(ways, keys, any_of);
  return keys;
}

/// Whether the first word tells which keys there are. Then editors offer the right ones of an alternative.
bool has_kinds(const Branch& ways) {
  constexpr std::size_t min_kinds = 3;  // of two, a rule is easier to read
  const std::optional<Decision>& first = ways.decision;
  if (!first || first->about != Decision::About::value || !first->maps.empty() || first->otherwise)
    return false;
  return ways.children.size() >= min_kinds &&
         std::any_of(ways.children.begin(), ways.children.end(), [&ways](const auto& child) {
           return keys_of(*child) != keys_of(*ways.children.front());
         });
}

/// The alternatives, one for each kind that is not refused altogether.
Json schema_by_kind(const Branch& ways) {
  const Decision& kind = *ways.decision;
  Json alternatives = Json::array();
  for (std::size_t i = 0; i < kind.values.size(); ++i) {
    Json object = object_schema(*ways.children[i]);
    if (!object["properties"].contains(kind.key)) continue;
    object["properties"][kind.key] = {{"const", kind.values[i]}};
    alternatives.push_back(object);
  }
  return {{"anyOf", alternatives}};
}

}  // namespace

Json object_schema(const Branch& ways) {
  if (has_kinds(ways)) return schema_by_kind(ways);
  std::vector<std::string> keys;
  std::vector<std::vector<std::string>> any_of;
  collect_keys(ways, keys, any_of);
  Json object = {{"type", "object"},
                 {"additionalProperties", false},
                 {"properties", Json::object()},
                 {"required", Json::array()}};
  for (const std::string& key : keys) add_property(object, key, *Demands(key).of(ways));
  add_refusals(object, ways);
  for (const auto& list : any_of) {
    Json alternatives = Json::array();
    for (const std::string& key : list) alternatives.push_back({{"required", {key}}});
    merge(object, {{"allOf", Json::array({Json{{"anyOf", alternatives}}})}});
  }
  if (object["required"].empty()) object.erase("required");
  return object;
}

}  // namespace upright
