#include "diagnosis_records.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>

#include "upright/model/registry.hpp"

namespace upright::blind {

namespace {

using nlohmann::json;

/// Structures that fit worse than the true one by less than this are not told apart.
constexpr double distinguishable = 16.0;

bool contains(const json& list, const std::string& text) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

const json& found_in(const json& r) {
  static const json nothing = json::array();
  return r.contains("found") ? r.at("found") : nothing;
}

bool is_in_declared_set(const json& r, const std::string& hidden) {
  for (const json& found : found_in(r))
    if (found.at("kind") == hidden || contains(found.at("confusable_with"), hidden)) return true;
  return false;
}

/// A shape of the force in place of a name: it describes and names nothing.
bool is_shape(const json& found) {
  return found.at("kind") == "force_table";
}

/// A base parameter, or the number of an effect that the plant file has: both are a few percent off in every
/// case.
bool is_correction(const json& r, const json& found) {
  return found.at("enters") == "parameter" || contains(r.at("known_effects"), found.at("kind"));
}

}  // namespace

Records read_records(const std::vector<std::string>& files) {
  Records records;
  std::set<std::string> keys;
  for (const std::string& file : files) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
      json record = json::parse(line, nullptr, false);
      if (!record.is_discarded() && keys.insert(key_of(record)).second) records.push_back(std::move(record));
    }
  }
  return records;
}

std::string key_of(const json& r) {
  return r.at("seed").dump() + "/" + r.at("case").dump() + "/" + condition_of(r) + "/" + r.value("only", "") +
         (is_timing(r) ? "/timing" : "");
}

std::string condition_of(const json& r) {
  if (r.contains("condition")) return r.at("condition");
  return r.value("disturbed", false) ? "disturbed" : "quantized";
}

bool is_failed(const json& r) {
  return r.contains("failed");
}

bool is_timing(const json& r) {
  return r.value("timing", false);
}

std::string first_hidden(const json& r) {
  if (!r.contains("hidden")) return r.value("label", "none");
  return r.at("hidden").empty() ? "none" : r.at("hidden")[0].get<std::string>();
}

bool is_null(const json& r) {
  return first_hidden(r) == "none";
}

bool is_unknown(const json& r) {
  if (r.contains("unknown")) return r.at("unknown");
  return effect_number(first_hidden(r)) == effect_count && !is_null(r) && !is_pair(r);
}

bool is_pair(const json& r) {
  return r.contains("hidden") ? r.at("hidden").size() == 2 : r.value("label", "") == "pair";
}

bool is_single(const json& r) {
  return !is_null(r) && !is_pair(r) && !is_unknown(r);
}

bool is_shown(const json& r) {
  return r.value("shown", true);
}

bool is_clearly_shown(const json& r) {
  return is_shown(r) && r.value("clearly_shown", true);
}

bool is_same_force(const json& r) {
  return r.contains("same_force") && !r.at("same_force").empty();
}

bool is_distinguishable(const json& r) {
  if (is_same_force(r)) return false;
  return !r.contains("worse_if_named") || r.at("worse_if_named").is_null() ||
         r.at("worse_if_named").get<double>() > distinguishable;
}

std::string first_named(const json& r) {
  return found_in(r).empty() ? "none" : found_in(r)[0].at("kind").get<std::string>();
}

bool is_right_first(const json& r) {
  return !is_failed(r) && first_named(r) == first_hidden(r);
}

bool is_right_set(const json& r) {
  if (is_failed(r)) return false;
  return is_right_first(r) ||
         (!found_in(r).empty() && contains(found_in(r)[0].at("confusable_with"), first_hidden(r)));
}

bool names_both(const json& r) {
  return !is_failed(r) && std::all_of(r.at("hidden").begin(), r.at("hidden").end(), [&](const json& kind) {
    return is_in_declared_set(r, kind.get<std::string>());
  });
}

std::size_t structural_effects(const json& r) {
  const json& found = found_in(r);
  return static_cast<std::size_t>(std::count_if(found.begin(), found.end(), [&](const json& effect) {
    return !is_correction(r, effect) && !is_shape(effect);
  }));
}

bool names_a_structure(const json& r) {
  return structural_effects(r) > 0;
}

bool is_described(const json& r) {
  return !is_failed(r) && r.at("verdict") == "described";
}

bool is_recognised(const json& r) {
  return is_described(r) || (!is_failed(r) && r.at("verdict") == "unexplained");
}

bool has_number(const json& r, const char* name) {
  return r.contains(name) && r.at(name).is_number();
}

double number_in(const json& r, const char* name) {
  return has_number(r, name) ? r.at(name).get<double>() : std::nan("");
}

double shrinking_of(const json& r) {
  return number_in(r, "gap_before") / number_in(r, "gap_after");
}

std::vector<Estimate> estimates_of(const json& r, const char* truths) {
  std::vector<Estimate> estimates;
  if (!r.contains(truths)) return estimates;
  for (const json& found : found_in(r)) {
    const std::string kind = found.at("kind");
    if (!r.at(truths).contains(kind)) continue;
    for (const auto& [name, p] : found.at("parameters").items()) {
      const bool stated = r.at(truths).at(kind).contains(name) && p.at("value").is_number();
      if (name == "center_m" || !stated) continue;
      const double truth = r.at(truths).at(kind).at(name), value = p.at("value");
      double off = value - truth, size = std::abs(truth);
      if (name == "phase_rad") {
        off = std::remainder(off, 2.0 * std::numbers::pi);
        size = std::numbers::pi;
      }
      // Without an interval nothing is claimed, and nothing is covered.
      const bool bounded = p.at("low").is_number() && p.at("high").is_number();
      const double low = bounded ? p.at("low").get<double>() : value,
                   high = bounded ? p.at("high").get<double>() : value;
      estimates.push_back({std::abs(off) / size, value - off >= low && value - off <= high});
    }
  }
  return estimates;
}

}  // namespace upright::blind
