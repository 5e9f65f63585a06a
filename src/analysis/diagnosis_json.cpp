#include "upright/analysis/diagnosis_json.hpp"

#include <cmath>

namespace upright {

namespace {

using nlohmann::json;

std::string kind_of(std::size_t effect) {
  return std::string(effect_registry()[effect].kind);
}

json number(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

json effect_json(const FoundEffect& effect) {
  json parameters = json::object();
  for (const ParameterEstimate& p : effect.parameters)
    parameters[p.name] = {
        {"value", number(p.value)}, {"ci95", {number(p.low), number(p.high)}}, {"unit", p.unit}};
  json confusable = json::array();
  for (const std::size_t other : effect.confusable_with) confusable.push_back(kind_of(other));
  return {{"kind", kind_of(effect.effect)},
          {"enters", std::string(name_of(effect_registry()[effect.effect].enters))},
          {"gap_before", number(effect.gap_before)},
          {"gap_after", number(effect.gap_after)},
          {"parameters", parameters},
          {"confusable_with", confusable},
          {"where", effect.where}};
}

}  // namespace

json diagnosis_json(const Diagnosis& diagnosis) {
  json effects = json::array();
  for (const FoundEffect& effect : diagnosis.effects) effects.push_back(effect_json(effect));
  json candidates = json::array();
  for (const CandidateScore& candidate : diagnosis.candidates)
    candidates.push_back({{"kind", kind_of(candidate.effect)},
                          {"gap_after", number(candidate.gap_after)},
                          {"evidence", number(candidate.evidence)}});
  json next = nullptr;
  if (diagnosis.next_experiment)
    next = {{"name", diagnosis.next_experiment->name},
            {"description", diagnosis.next_experiment->description},
            {"distance", number(diagnosis.next_experiment->distance)}};
  return {{"verdict", std::string(name_of(diagnosis.verdict))},
          {"gap",
           {{"measure", "held-out simulation error / noise floor"},
            {"before", number(diagnosis.gap_before)},
            {"after", number(diagnosis.gap_after)}}},
          {"effects", effects},
          {"candidates", candidates},
          {"next_experiment", next},
          {"residual", diagnosis.residual},
          {"noise",
           {{"force_n_sqrt_s", number(diagnosis.noise.force)},
            {"torque_nm_sqrt_s", number(diagnosis.noise.torque)},
            {"jitter_s", number(diagnosis.noise.jitter_s)}}},
          {"notes", diagnosis.notes}};
}

}  // namespace upright
