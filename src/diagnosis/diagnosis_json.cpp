#include "diagnosis_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "described_curve.hpp"

namespace upright {

namespace {

using nlohmann::json;

json number(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

json parameters_json(const std::vector<ParameterEstimate>& estimates) {
  json parameters = json::object();
  for (const ParameterEstimate& p : estimates)
    parameters[p.name] = {
        {"value", number(p.value)}, {"ci95", {number(p.low), number(p.high)}}, {"unit", p.unit}};
  return parameters;
}

json noise_json(const Noise& noise) {
  return {{"force_n_sqrt_s", number(noise.force)},
          {"torque_nm_sqrt_s", number(noise.torque)},
          {"coloured_force_n", number(noise.coloured_force_n)},
          {"coloured_torque_nm", number(noise.coloured_torque_nm)},
          {"correlation_s", number(noise.correlation_s)},
          {"jitter_s", number(noise.jitter_s)},
          {"sensors", number(noise.sensors)}};
}

json statistic_json(const ResidualStatistic& statistic) {
  return {{"name", statistic.name},
          {"value", number(statistic.value)},
          {"limit", number(statistic.limit)},
          {"counts", statistic.counts_above ? "above" : "below"},
          {"p_value", statistic.p_value ? number(*statistic.p_value) : json(nullptr)},
          {"fails", statistic.fails}};
}

json trial_json(const Trial& trial) {
  return {{"round", trial.round + 1},
          {"kind", kind_of(trial.effect)},
          {"evidence", number(trial.evidence)},
          {"held_out", number(trial.held)},
          {"t", number(trial.t_value)},
          {"standard_errors", number(trial.certainty)},
          {"dispersion", number(trial.dispersion)},
          {"parameters", parameters_json(trial.parameters)},
          {"noise", noise_json(trial.noise)},
          {"rule", trial.rule},
          {"taken", trial.taken}};
}

json step_json(const Step& step) {
  json effects = json::array();
  for (const Step::Effect& effect : step.effects)
    effects.push_back({{"kind", kind_of(effect.effect)}, {"parameters", parameters_json(effect.parameters)}});
  return effects;
}

json next_best_json(const NextBest& best) {
  json others = json::array();
  for (const Trial* other : best.others)
    others.push_back({{"kind", kind_of(other->effect)},
                      {"evidence", number(other->evidence)},
                      {"of", number(best.taken->evidence)},
                      {"parameters", parameters_json(other->parameters)}});
  return others;
}

/// Empty where the caller did not name its runs.
std::string run_name(const Diagnosis& diagnosis, std::size_t run) {
  return run < diagnosis.run_names.size() ? diagnosis.run_names[run] : "";
}

json shown_on_json(const Diagnosis& diagnosis, const std::vector<RunEvidence>& shown_on) {
  json runs = json::array();
  for (const RunEvidence& of : shown_on)
    runs.push_back({{"run", run_name(diagnosis, of.run)},
                    {"evidence", number(of.evidence)},
                    {"share", number(share_of(of, shown_on))}});
  return runs;
}

json by_run_json(const Diagnosis& diagnosis, std::size_t effect, const std::vector<RunSize>& sizes) {
  const ParameterInfo& size = effect_registry()[effect].parameters[0];
  json runs = json::array();
  for (const RunSize& of : sizes)
    runs.push_back({{"run", run_name(diagnosis, of.run)},
                    {"parameter", std::string(size.name)},
                    {"unit", std::string(size.unit)},
                    {"value", number(of.value)},
                    {"ci95", {number(of.low), number(of.high)}}});
  return runs;
}

json shows_most_json(const Diagnosis& diagnosis, const FoundEffect& effect) {
  if (effect.shown_on.empty()) return nullptr;
  const ShownStretch& most = effect.shows_most;
  return {{"run", run_name(diagnosis, most.run)},
          {"from_s", number(most.from_s)},
          {"to_s", number(most.to_s)},
          {"evidence", number(most.evidence)}};
}

json local_json(const Diagnosis& diagnosis, const LocalEffect& effect) {
  return {{"kind", kind_of(effect.effect)},
          {"parameters", parameters_json(effect.parameters)},
          {"where", effect.where},
          {"shown_on", shown_on_json(diagnosis, effect.shown_on)},
          {"by_run", by_run_json(diagnosis, effect.effect, effect.by_run)}};
}

json detectable_json(const Detectable& d) {
  const std::span<const ParameterInfo> parameters = effect_registry()[d.effect].parameters;
  json at = json::object();
  for (std::size_t i = 0; i < d.at.size(); ++i) at[std::string(parameters[i + 1].name)] = number(d.at[i]);
  return {{"kind", kind_of(d.effect)},
          {"parameter", std::string(parameters[0].name)},
          {"unit", std::string(parameters[0].unit)},
          {"size", number(d.size)},
          {"usual", number(d.usual)},
          {"at", at}};
}

json moved_number_json(const MovedNumber& n) {
  return {{"number", n.name},
          {"unit", n.unit},
          {"file", number(n.file)},
          {"fitted", number(n.fitted)},
          {"believed_within", {number(n.low), number(n.high)}}};
}

json range_json(const QuantityRange& range) {
  return {{"quantity", range.quantity},
          {"unit", range.unit},
          {"low", number(range.low)},
          {"high", number(range.high)}};
}

json score_json(const ModelScore& score) {
  return {{"gap", number(score.gap)},
          {"cart_rmse_m", number(score.cart_rmse_m)},
          {"theta_rmse_rad", number(score.theta_rmse_rad)}};
}

/// Every element of a list, by its own function.
template <class T, class F>
json list_json(const std::vector<T>& list, const F& as_json) {
  json items = json::array();
  for (const T& item : list) items.push_back(as_json(item));
  return items;
}

json validated_json(const ValidatedRun& run) {
  return {{"file", run.name},
          {"given", score_json(run.given)},
          {"found", score_json(run.found)},
          {"found_is_worse", run.is_worse()},
          {"beyond", list_json(run.beyond, range_json)}};
}

json curve_json(const DescribedCurve& curve) {
  json intervals = json::array();
  for (std::size_t i = 0; i < curve.at.size(); ++i)
    intervals.push_back({number(curve.low_n[i]), number(curve.high_n[i])});
  return {{"over", curve.over},
          {"unit", curve.unit},
          {"at", curve.at},
          {"force_n", curve.force_n},
          {"ci95", intervals}};
}

json effect_json(const Diagnosis& diagnosis, const FoundEffect& effect) {
  json confusable = json::array();
  for (const std::size_t other : effect.indistinguishable_from) confusable.push_back(kind_of(other));
  json document = {{"kind", kind_of(effect.effect)},
                   {"enters", std::string(name_of(effect_registry()[effect.effect].enters))},
                   {"gap_before", number(effect.gap_before)},
                   {"gap_after", number(effect.gap_after)},
                   {"parameters", parameters_json(effect.parameters)},
                   {"confusable_with", confusable},
                   {"next_best", next_best_json(next_best(diagnosis, effect))},
                   {"where", effect.where},
                   {"shown_on", shown_on_json(diagnosis, effect.shown_on)},
                   {"by_run", by_run_json(diagnosis, effect.effect, effect.by_run)},
                   {"shows_most", shows_most_json(diagnosis, effect)}};
  if (const auto curve = described_curve(effect)) document["curve"] = curve_json(*curve);
  return document;
}

}  // namespace

std::string diagnosis_json(const Diagnosis& diagnosis) {
  json effects = json::array();
  for (const FoundEffect& effect : diagnosis.effects) effects.push_back(effect_json(diagnosis, effect));
  json candidates = json::array();
  for (const CandidateScore& candidate : diagnosis.candidates)
    candidates.push_back({{"kind", kind_of(candidate.effect)},
                          {"gap_after", number(candidate.gap_after)},
                          {"evidence", number(candidate.evidence)}});
  json trials = json::array();
  for (const Trial& trial : diagnosis.trials) trials.push_back(trial_json(trial));
  json steps = json::array();
  for (const Step& step : diagnosis.steps) steps.push_back(step_json(step));
  json next = nullptr;
  if (diagnosis.next_experiment)
    next = {{"name", diagnosis.next_experiment->name},
            {"description", diagnosis.next_experiment->description},
            {"file", diagnosis.next_experiment->file},
            {"distance", number(diagnosis.next_experiment->distance)}};
  json document = {
      {"verdict", std::string(name_of(diagnosis.verdict))},
      {"gap",
       {{"measure", "held-out simulation error / noise floor"},
        {"before", number(diagnosis.gap_before)},
        {"after", number(diagnosis.gap_after)}}},
      {"effects", effects},
      {"helps_here_only", list_json(diagnosis.helps_here_only,
                                    [&](const LocalEffect& local) { return local_json(diagnosis, local); })},
      {"numbers", list_json(diagnosis.numbers, moved_number_json)},
      {"detectable", list_json(diagnosis.detectable, detectable_json)},
      {"measured_range", list_json(diagnosis.measured_range, range_json)},
      {"validation", list_json(diagnosis.validation, validated_json)},
      {"candidates", candidates},
      {"next_experiment", next},
      {"residual", diagnosis.residual},
      {"residual_tests", list_json(diagnosis.residual_tests, statistic_json)},
      {"noise", noise_json(diagnosis.noise)},
      {"steps", steps},
      {"trials", trials},
      {"notes", diagnosis.notes}};
  // Of a search that was not finished only.
  if (diagnosis.interrupted) document["interrupted"] = true;
  if (diagnosis.bound_reached) document["bound_reached"] = true;
  if (!diagnosis.not_examined.empty()) {
    document["quick"] = true;
    document["not_examined"] = diagnosis.not_examined;
  }
  return document.dump(2);
}

}  // namespace upright
