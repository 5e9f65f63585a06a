#include "upright/diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <sstream>
#include <tuple>

#include "adequacy.hpp"
#include "base/parallel.hpp"
#include "base_numbers.hpp"
#include "detectable.hpp"
#include "disturbance_null.hpp"
#include "doubtful_scales.hpp"
#include "estimation/coarse_record.hpp"
#include "estimation/held_out.hpp"
#include "estimation/smoother.hpp"
#include "final_fits.hpp"
#include "force_description.hpp"
#include "indistinguishable.hpp"
#include "listing.hpp"
#include "next_experiment.hpp"
#include "place_null.hpp"
#include "plant_scale.hpp"
#include "plausibility.hpp"
#include "quick.hpp"
#include "repeated_search.hpp"
#include "reproducibility.hpp"
#include "run_differences.hpp"
#include "search.hpp"
#include "stepwise_selection.hpp"
#include "thinned_record.hpp"
#include "unusual_disturbance.hpp"
#include "upright/base/error.hpp"
#include "verdict.hpp"

namespace upright {

namespace {

/// What a diagnosis works on.
struct Record {
  const std::vector<Measurement>& runs;
  const std::vector<Measurement>* all_samples = nullptr;  ///< of the runs, where those are thinned
};

class Diagnostician {
 public:
  Diagnostician(const Plant& plant, const Record& record, const DiagnosisOptions& options, HeldOut which)
      : policy_(policy_for(plant)),
        budget_(options.quick ? quick_budget() : SearchBudget{}),
        plant_(plant),
        runs_(record.runs),
        options_(options),
        data_(split(runs_, which, policy_.excitation.arm_m, policy_.excitation.speed_window_s)),
        work_samples_(options.search_bound * (sample_count(data_.train) + sample_count(data_.held))),
        bound_(work_samples_),
        search_(plant_, runs_, bounded(data_.train), bounded(data_.held), policy_, budget_),
        selection_(search_, options, result_),
        fits_(search_, selection_, record.all_samples, options) {}

  /// `only_missing`: the answer counts only if an effect was found that the plant file lacks.
  Diagnosis run(bool only_missing = false) {
    try {
      selection_.begin();
      selection_.find();
      if (only_missing && !found_missing_effect()) return std::move(result_);
      ResidualTests left = settle();
      if (!options_.quick) left = search_further(left);
      conclude(beside_coloured_noise(without_local_effects(left)));
    } catch (const Interrupted&) {
      result_.interrupted = true;
    } catch (const BoundReached&) {
      examine_at_bound();
    }
    if (!decided_) report_so_far();
    return std::move(result_);
  }
  /// Looks for a force on the cart beside what run() found. A curve that more than halves the held-out error
  /// is added to the answer; one that lowers it by more than chance shows that something is missing.
  void describe_what_is_left(Diagnosis& diagnosis) {
    if (!beyond_sensors_) return;
    options_.report_progress(0.98, "describing what is left");
    try {
      const auto force = describe_force(search_, fits_.judged(), fits_.known(), without_trend_);
      const double named = std::min(listing_.numbers_moved.value_or(listing_.after), listing_.after);
      const double lower = force ? named / force->held_out_error : 1.0;
      if (lower > policy_.significance.clear_ratio) {
        add_curve(*force, named, diagnosis);
      } else if (force && force->shows_on_held_out(lower, policy_)) {
        diagnosis.verdict = Verdict::unexplained;
        diagnosis.residual = force->left_sentence();
      } else if (const auto left = track_force_left(search_, fits_.known())) {
        report_track_force(*left, search_.range(), policy_.prior, diagnosis);
      }
    } catch (const Interrupted&) {
      diagnosis.interrupted = true;
    } catch (const BoundReached&) {
      diagnosis.bound_reached = true;
    }
  }
  /// That all fits processed.
  double work_samples() const { return bound_.counted_samples(); }
  /// Whether an effect was found that the plant file lacks, not only numbers of it that are off.
  bool found_missing_effect() const {
    return std::any_of(selection_.found().begin(), selection_.found().end(),
                       [&](std::size_t effect) { return !search_.is_nuisance(effect); });
  }
  bool is_disturbed() const { return disturbed_; }  ///< by more than is usual
  /// Minus twice the log likelihood of all runs, and of the priors, with what is named in the end.
  double objective_of_all_runs() const { return fits_.known().train.objective; }
  /// Whether other held-out runs may change the answer. If it is unexplained: held-out runs alone may show
  /// what is missing, or contradict the others to the end.
  bool is_worth_repeating(const Diagnosis& answer, bool unexplained) const {
    if (!unexplained) return !found_missing_effect() && may_find_more_with_other_runs(answer, data_, policy_);
    return selection_.contradicted() || largest_voltage_is_held_out(data_) ||
           !examine_fit(data_.train, fits_.judged().train.point, policy_, budget_).structured;
  }

 private:
  const FitData& bounded(FitData& data) {
    data.bound = &bound_;
    return data;
  }

  /// `named`: the held-out error without the curve.
  void add_curve(const ForceDescription& force, double named, Diagnosis& diagnosis) const {
    const double floor = std::min(floor_, force.held_out_error);
    scale_gaps(diagnosis, floor_ / floor);
    for (FoundEffect& found : diagnosis.effects)
      if (force.moved(found.effect)) found.parameters = estimates_of(found.effect, force.known);
    // The curve may account for all of one.
    std::erase_if(diagnosis.effects, [&](const FoundEffect& found) {
      const double neutral = effect_registry()[found.effect].parameters[0].neutral;
      return !found.parameters.empty() && found.parameters[0].value == neutral;
    });
    diagnosis.effects.push_back(force.as_effect(named / floor, force.held_out_error / floor));
    diagnosis.gap_after = diagnosis.effects.back().gap_after;
    diagnosis.verdict = Verdict::described;
    std::vector<std::size_t> listed;
    for (const FoundEffect& found : diagnosis.effects) listed.push_back(found.effect);
    diagnosis.model = model_with(plant_, force.known.train.point.plant, search_.nuisances(), listed);
    diagnosis.numbers = moved_numbers(plant_, diagnosis.model, search_.range(), policy_.prior);
    diagnosis.noise = force.known.train.point.noise;
    const ResidualTests left = examine_fit(search_.all_data(), force.known.train.point, policy_, budget_);
    diagnosis.residual = left.sentence;
    diagnosis.residual_tests = reported_tests(left, policy_);
    diagnosis.residual_after = smooth_residuals(data_.held, force.judged.held.point, policy_.location.walk);
  }

  /// Examines what a search that reached its bound has found, within a bound of its own.
  void examine_at_bound() {
    result_.bound_reached = true;
    if (decided_) return;
    bound_.grant(budget_.examination_share * work_samples_);
    try {
      conclude(beside_coloured_noise(without_local_effects(settle())));
    } catch (const Interrupted&) {
      result_.interrupted = true;
    } catch (const BoundReached&) {
      // What is known until here is reported.
    }
  }

  /// What a search that was given up has found, unexamined: nothing is claimed of it.
  void report_so_far() {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    const Hypothesis& h = selection_.current();
    const auto known_gap = [&](const Hypothesis& of) { return of.simulation ? of.simulation->gap : unknown; };
    note_runs();
    result_.examined = false;
    for (const std::size_t effect : selection_.found()) {
      FoundEffect found;
      found.effect = effect;
      found.gap_before = found.gap_after = unknown;
      found.parameters = estimates_of(effect, h);
      found.where = selection_.where(effect);
      result_.effects.push_back(found);
    }
    for (CandidateScore& candidate : result_.candidates) candidate.gap_after = unknown;
    result_.gap_before = known_gap(selection_.given());
    result_.gap_after = known_gap(h);
    result_.noise = h.train.point.noise;
    result_.model = selection_.found().empty()
                        ? plant_
                        : model_with(plant_, h.train.point.plant, search_.nuisances(), selection_.found());
    result_.residual = "not examined: the search was not finished";
    result_.verdict = moves_enough(runs_, policy_.excitation) ? Verdict::unexplained : Verdict::not_excited;
  }

  /// Begins the account of what was found.
  void note_runs() {
    result_.notes.clear();
    result_.effects.clear();
    result_.run_names.clear();
    for (const Measurement& run : runs_) result_.run_names.push_back(run.name);
    result_.measured_range = search_.range().measured;
    for (const Measurement& run : runs_)
      result_.notes.insert(result_.notes.end(), run.notes.begin(), run.notes.end());
    if (runs_.size() == 1) result_.notes.push_back("one run only: a third of its segments is held out");
    result_.held_out_runs = data_.held_out_runs;
  }

  /// Where more than noise is left, the search goes on.
  ResidualTests search_further(ResidualTests left) {
    if (left.structured && selection_.renew_initial_states()) left = settle();
    if (left.structured || left.beyond_sensors) left = with_attached_mass(left);
    if (left.structured && selection_.find_pairs_of_all()) left = settle();
    if (left.structured && selection_.find_without_each()) left = settle();
    if (left.beyond_sensors && selection_.find_thoroughly(left.structured)) left = settle();
    return left;
  }

  /// A mass that may swing as it likes fits a part of most of what is left, so unless it is certain it stays
  /// only if nothing is left beside it, or beside it and what else the data then show.
  ResidualTests with_attached_mass(const ResidualTests& left) {
    if (!selection_.find_attached_mass(left.structured)) return left;
    ResidualTests with = settle();
    if (with.structured) {
      selection_.find_again();
      with = settle();
    }
    if (selection_.has_certain_attached_mass()) return with;
    if (selection_.has_attached_mass() && !beside_coloured_noise(with).structured) return with;
    selection_.give_up_attached_mass();
    return settle();
  }

  /// Settles the corrections, and looks at what is left.
  ResidualTests settle() {
    fits_.settle(withdrawn_);
    return what_is_left();
  }

  /// At the settled model.
  ResidualTests what_is_left() const {
    options_.report_progress(0.92, "measuring the gap");
    // At what all runs say, so that what few training runs left uncertain is not taken for something missing.
    return tests_of(fits_.known().train.point, fits_.judged().train.point.noise);
  }

  /// What is left at a fit to all runs, with this noise in held-out ones.
  ResidualTests tests_of(const FitPoint& fitted, const Noise& noise) const {
    ResidualTests left = examine_fit(search_.data_of(fitted), fitted, policy_, budget_);
    if (!left.structured) compare_held_out(search_, fits_.judged(), noise, left);
    if (left.structured) return left;
    if (const auto impossible = sentence_on_impossible_scale(fits_.known(), fits_.effects())) {
      left.structured = true;
      left.sentence = *impossible;
    }
    return left;
  }

  /// The noise of the search is white. A disturbance that lasts looks like something missing beside it, and
  /// moves a simulation further than such noise does: the last word has noise with a coloured part, where
  /// that accounts for the residual better. What passes the tests beside white noise has passed them.
  ResidualTests beside_coloured_noise(const ResidualTests& left) {
    noise_ = fits_.known().train.point.noise;
    disturbed_ = false;
    options_.report_progress(0.945, "estimating a coloured disturbance");
    const FitResult coloured = search_.with_coloured_noise(fits_.known());
    const double evidence = minus_log_likelihood(fits_.known().train) - minus_log_likelihood(coloured);
    ResidualTests beside = left;
    if (evidence > policy_.acceptance.min_evidence) {
      const ResidualTests tests = tests_of(coloured.point, coloured.point.noise);
      if (!tests.structured || left.structured) {
        beside = tests;
        noise_ = coloured.point.noise;
      }
    }
    disturbed_ = find_unusual_disturbance(noise_, search_.range(), policy_.prior, beside);
    return beside;
  }

  /// What is left once all effects are gone that are not to be named.
  ResidualTests without_local_effects(const ResidualTests& left) {
    if (!withdraw_next()) return left;
    do {
      fits_.settle(withdrawn_);
    } while (withdraw_next());
    return what_is_left();
  }

  /// An effect is not named if it does not reproduce, or if held-out data are simulated better without it.
  /// One of these goes, or a fitted number of the plant file. False: there is none.
  bool withdraw_next() {
    options_.report_progress(0.93, "comparing parts of the data");
    reproductions_ = reproduce(search_, fits_.known(), fits_.effects());
    if (without_trend_)
      list();
    else if (withdraw_unsupported())
      return true;
    return withdraw_uncertain();
  }

  void list() {
    options_.report_progress(0.94, "measuring the gap");
    listing_ = list_effects(search_, fits_.judged(), {fits_.effects(), fits_.corrections()});
  }

  /// One of those that other data, or a disturbance, speak against.
  bool withdraw_unsupported() {
    if (options_.quick && withdraw_doubtful()) return true;
    const Reproduction* worst = nullptr;
    for (const Reproduction& r : reproductions_)
      if (is_contradicted(r, policy_.significance) && (worst == nullptr || r.t_value < worst->t_value))
        worst = &r;
    if (worst != nullptr) {
      withdraw(worst->effect, worst->where);
      return true;
    }
    differences_ = run_differences(search_, fits_.known(), fits_.effects());
    if (const RunDifference* differs = most_certain_of_single_runs(differences_, policy_.significance)) {
      withdraw(differs->effect, sentence_on(*differs, runs_));
      result_.helps_here_only.back().by_run = differs->sizes;
      selection_.exclude(same_force_as(differs->effect));
      selection_.find_again();
      return true;
    }
    if (const auto outdone = outdone_by_disturbance(search_, fits_.known(), fits_.judged(), reproductions_)) {
      withdraw(outdone->effect, outdone->where);
      if (outdone->was_average && !withdrawn_.contains(effect_number("constant_force")))
        selection_.find_again();
      return true;
    }
    list();
    if (listing_.number_raises) {
      put_back(*listing_.number_raises);
      return true;
    }
    if (listing_.raises) {
      withdraw(*listing_.raises,
               "it helps the runs that were fitted, but held-out data are simulated better without it");
      return true;
    }
    return false;
  }

  /// One of those whose values are too uncertain. A trend of the place goes last, because the others are
  /// judged beside it: without it, each would have to supply the average force.
  bool withdraw_uncertain() {
    fits_.fit_all_samples();
    if (const auto uncertain = fits_.uncertain_effect()) {
      withdraw(uncertain->effect, uncertain->where);
      return true;
    }
    if (const auto trend = trend_of_place(search_, fits_.known())) {
      withdraw(trend->effect, trend->where);
      without_trend_ = true;
      return true;
    }
    return false;
  }

  /// A fitted number stands for something else where that of the file simulates held-out data better: the
  /// search goes on with this one.
  void put_back(std::size_t number) {
    const std::vector<std::size_t>& corrections = fits_.corrections();
    if (std::find(corrections.begin(), corrections.end(), number) != corrections.end())
      withdraw(number, "held-out data are simulated better with the number of the plant file");
    selection_.hold(number);
    selection_.find_again();
  }

  /// Of a quick diagnosis: all that are not certain enough go. False: there are none.
  bool withdraw_doubtful() {
    const std::vector<std::size_t> doubtful = doubtful_effects(reproductions_, search_);
    for (const std::size_t effect : doubtful)
      if (!withdrawn_.contains(effect))
        withdraw(effect, "not certain enough for a quick diagnosis: repeat it without --quick");
    return !doubtful.empty();
  }

  void withdraw(std::size_t effect, const std::string& where) {
    for (const std::size_t gone : selection_.withdraw(effect)) {
      LocalEffect local{gone, estimates_of(gone, fits_.known()), where, {}, {}};
      if (gone != effect) local.where = "it cannot be without " + kind_of(effect);
      for (const Reproduction& r : reproductions_)
        if (r.effect == gone) local.shown_on = r.runs;
      result_.helps_here_only.push_back(local);
      withdrawn_.insert(gone);
    }
  }

  void conclude(const ResidualTests& tests) {
    options_.report_progress(0.95, "measuring the noise floor");
    note_runs();
    result_.noise = noise_;
    const std::vector<std::size_t> all = fits_.effects();
    // The same floor whatever the verdict: nearly equal fits are measured in the same unit. An error that was
    // reached is no less than the floor.
    const double usual = held_out_floor(search_, fits_.judged(), noise_, tests).usual;
    // Without an effect the numbers of the file stand, unless they are what is clearly off.
    const bool numbers_only = all.empty() && listing_.numbers_moved < listing_.before &&
                              listing_.before > policy_.significance.clear_ratio * usual;
    if (numbers_only) listing_.after = *listing_.numbers_moved;
    floor_ = std::max(std::min(usual, listing_.after), std::numeric_limits<double>::min());
    result_.gap_before = listing_.before / floor_;
    for (const Listing::Row& row : listing_.rows) {
      FoundEffect found;
      found.effect = row.effect;
      found.gap_before = row.before / floor_;
      found.gap_after = row.after / floor_;
      found.parameters = estimates_of(row.effect, fits_.reported());
      found.where = selection_.where(row.effect);
      for (const Reproduction& r : reproductions_)
        if (r.effect == row.effect) {
          found.shown_on = r.runs;
          found.shows_most = r.shows_most;
        }
      for (const RunDifference& difference : differences_)
        if (difference.effect == row.effect) found.by_run = difference.sizes;
      result_.effects.push_back(found);
    }
    result_.gap_after = listing_.after / floor_;
    result_.residual = tests.sentence;
    result_.residual_tests = reported_tests(tests, policy_);
    const Plant& fitted = fits_.reported().train.point.plant;
    result_.model =
        all.empty() && !numbers_only ? plant_ : model_with(plant_, fitted, search_.nuisances(), all);
    result_.numbers = moved_numbers(plant_, result_.model, search_.range(), policy_.prior);
    for (auto& candidate : result_.candidates) {
      candidate.gap_after = result_.gap_before;
      for (auto& [effect, h] : selection_.finalists()) {
        if (effect != candidate.effect) continue;
        candidate.evidence = selection_.finalist_evidence(effect);
        candidate.gap_after = search_.simulate(h).gap / floor_;
      }
    }
    std::stable_sort(result_.candidates.begin(), result_.candidates.end(),
                     [](const auto& a, const auto& b) { return a.evidence > b.evidence; });
    for (const std::size_t number : search_.held_numbers())
      result_.notes.push_back("the value of the plant file stays: with a fitted " + kind_of(number) +
                              ", held-out data are simulated worse");
    for (const std::string& note : notes_on_doubtful_numbers(fits_.reported(), all, policy_.prior))
      result_.notes.push_back(note);
    beyond_sensors_ = tests.beyond_sensors;
    freed_effects_ = freed_effects(search_, fits_.judged(), all);
    result_.detectable = detectable_sizes(search_, fits_.judged(), freed_effects_);
    decide(tests);
    trace_residuals();
    if (!options_.quick) find_indistinguishable();
  }

  void trace_residuals() {
    if (data_.held.segments.empty()) return;
    const Noise noise = fits_.judged().train.point.noise;
    result_.residual_after = smooth_residuals(data_.held, fits_.judged().held.point, policy_.location.walk);
    Hypothesis as_given = search_.fitted_separately({}, fits_.judged(), &noise);
    search_.filter_held_out(as_given, noise);
    result_.residual_before = smooth_residuals(data_.held, as_given.held.point, policy_.location.walk);
  }

  void decide(const ResidualTests& tests) {
    const std::vector<Detectable> hidden = may_hide(result_.detectable, plant_, policy_.power);
    const VerdictGrounds grounds{tests.structured, result_.gap_after > policy_.significance.clear_ratio,
                                 !hidden.empty(), moves_enough(runs_, policy_.excitation)};
    result_.verdict = verdict_of(result_, grounds);
    if (result_.verdict == Verdict::not_excited) {
      const std::string reason = why_not_excited(result_, grounds, hidden);
      if (!reason.empty()) result_.notes.push_back(reason);
    }
    decided_ = true;
  }

  /// Other effects that do as well in the place of one that was found: from sensitivities, or fitted where an
  /// effect does not act in proportion to its size.
  void find_indistinguishable() {
    options_.report_progress(0.96, "searching for confusable effects");
    std::vector<std::pair<std::size_t, Plant>> alternatives;
    for (const Alternative& alternative :
         linear_alternatives(search_, fits_.judged(), fits_.effects(), freed_effects_)) {
      declare(alternative.instead_of, alternative.effect);
      alternatives.emplace_back(alternative.effect, alternative.plant);
    }
    std::optional<double> on_screening_subset;
    for (const std::size_t effect : selection_.found()) {
      std::optional<Hypothesis> without;
      for (const std::size_t other : selection_.similar_effects(effect)) {
        if (is_listed(other) || is_declared(effect, other)) continue;
        options_.report_progress(0.97, "fitting " + kind_of(other) + " in place of " + kind_of(effect));
        if (!without) without = search_.without(selection_.current(), effect);
        if (!std::isfinite(without->train.objective)) break;
        if (!on_screening_subset)
          on_screening_subset = search_.on_screening_subset(selection_.current()).train.objective;
        const auto plant =
            fitted_alternative(search_, selection_.current(), *without, other, *on_screening_subset);
        if (!plant) continue;
        declare(effect, other);
        alternatives.emplace_back(other, *plant);
      }
    }
    if (!alternatives.empty())
      result_.next_experiment = choose_experiment(fits_.judged().train.point.plant, alternatives, runs_);
  }

  FoundEffect& listed(std::size_t effect) {
    return *std::find_if(result_.effects.begin(), result_.effects.end(),
                         [&](const FoundEffect& found) { return found.effect == effect; });
  }
  bool is_listed(std::size_t effect) const {
    const std::vector<std::size_t> all = fits_.effects();
    return std::find(all.begin(), all.end(), effect) != all.end();
  }
  bool is_declared(std::size_t effect, std::size_t other) {
    const std::vector<std::size_t>& others = listed(effect).indistinguishable_from;
    return std::find(others.begin(), others.end(), other) != others.end();
  }
  void declare(std::size_t effect, std::size_t other) {
    listed(effect).indistinguishable_from.push_back(other);
  }

  const SelectionPolicy policy_;
  const SearchBudget budget_;
  const Plant plant_;
  const std::vector<Measurement>& runs_;
  const DiagnosisOptions& options_;
  Diagnosis result_;
  DataSplit data_;
  const double work_samples_;  ///< of the search at most
  WorkBound bound_;
  double floor_ = 1.0;           ///< error of a simulation that noise accounts for [sensor noise]
  bool decided_ = false;         ///< the verdict stands
  bool beyond_sensors_ = false;  ///< more is left than noise of the sensors
  bool disturbed_ = false;       ///< a large or drifting disturbance is left
  Search search_;
  StepwiseSelection selection_;
  FinalFits fits_;
  Noise noise_;                      ///< of all runs beside the model of `fits_`
  std::set<std::size_t> withdrawn_;  ///< found, and not named
  bool without_trend_ = false;       ///< the last of these was a trend of the place
  std::vector<Reproduction> reproductions_;
  std::vector<RunDifference> differences_;
  Listing listing_;
  std::vector<FreedEffect> freed_effects_;
};

/// The search with other runs held out, where that may show more, and what is left in the end.
void look_further(const Plant& plant, const Record& record, const DiagnosisOptions& options,
                  Diagnostician& first, std::optional<Diagnostician>& second, Diagnosis& diagnosis) {
  if (diagnosis.verdict == Verdict::not_excited || diagnosis.interrupted || diagnosis.bound_reached) return;
  const bool unexplained = diagnosis.verdict == Verdict::unexplained && !first.is_disturbed();
  try {
    if (first.is_worth_repeating(diagnosis, unexplained)) {
      options.report_progress(0.02, "repeating the search with other runs held out");
      second.emplace(plant, record, options, HeldOut::other);
      Diagnosis other = second->run(!unexplained);
      const double saved = first.objective_of_all_runs() - second->objective_of_all_runs();
      const bool explains = other.verdict == Verdict::explained || second->is_disturbed();
      const bool is_open = unexplained || second->found_missing_effect();
      if (is_open && is_better_answer(saved, explains, unexplained, SelectionPolicy{}.acceptance)) {
        second->describe_what_is_left(other);
        other.notes.emplace_back(
            "the runs held out at first show what the others alone do not: others were held out instead");
        diagnosis = std::move(other);
        return;
      }
      diagnosis.interrupted = other.interrupted;
      diagnosis.bound_reached = other.bound_reached;
    }
    if (!diagnosis.interrupted) first.describe_what_is_left(diagnosis);
  } catch (const Interrupted&) {
    diagnosis.interrupted = true;
  } catch (const BoundReached&) {
    diagnosis.bound_reached = true;
  }
}

}  // namespace

Diagnosis diagnose(const Plant& plant, const std::vector<Measurement>& runs,
                   const DiagnosisOptions& options) {
  if (runs.empty()) throw ConfigError("no run was given: give at least one with --data");
  if (const std::string fault = fault_of(plant); !fault.empty()) throw ConfigError(fault);
  const bool shared = std::any_of(runs.begin(), runs.end(), [&](const Measurement& run) {
    return run.has_cart() || (run.has_theta() && plant.pendulum);
  });
  if (!shared)
    throw ConfigError(
        "the runs contain only theta_rad, and the model has no pendulum: add the pendulum to the plant file");
  const InterruptibleWork watch(options.signal);
  const SearchBudget budget;
  const std::vector<Measurement> thinned =
      options.quick ? coarse_runs(runs, plant, {budget.quick_period_s, budget.quick_shift})
                    : thinned_runs(runs, plant, budget);
  const Record record{thinned.empty() ? runs : thinned, thinned.empty() || options.quick ? nullptr : &runs};
  Diagnostician first(plant, record, options, HeldOut::middle);
  std::optional<Diagnostician> second;
  Diagnosis diagnosis = first.run();
  if (options.quick)
    diagnosis.not_examined = not_examined_quickly();
  else
    look_further(plant, record, options, first, second, diagnosis);
  diagnosis.work_samples = first.work_samples() + (second ? second->work_samples() : 0.0);
  return diagnosis;
}

}  // namespace upright
