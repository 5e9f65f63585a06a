// How the model grows: effects are added one at a time for as long as the data ask for one, exchanged for
// what resembles them, tried in pairs, and dropped when they are not needed.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "decision.hpp"
#include "search.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// Works on one Search, which must outlive it. What was tried is written to `record`: candidates, trials,
/// steps.
class StepwiseSelection {
 public:
  StepwiseSelection(Search& search, const DiagnosisOptions& options, Diagnosis& record);

  /// Fits the plant file as given: before everything else. Throws ConfigError when that cannot be simulated.
  /// This and what follows throw Interrupted and BoundReached; what was found until then stays readable.
  void begin();
  /// From the plant file: one effect after the other, and pairs in their place.
  void find();
  /// What is left is more than noise: the same model from initial states as the data show them. Whether that
  /// is better.
  bool renew_initial_states();
  /// What is left is more than noise: pairs of all that resembled the best effect. Whether the model changed.
  bool find_pairs_of_all();
  /// What is left is more than the sensors' noise: the best of the last round again, as all of the training
  /// data show them, or every effect if the last round lacked the largest voltage. If something is
  /// `certainly_missing`, every effect is tried with little noise beyond the sensors' first, since much noise
  /// hides what a poor fit leaves (beside a disturbance it hides nothing), and all of the data are used only
  /// if they are few. Whether the model changed.
  bool find_thoroughly(bool certainly_missing);

  /// What is left is more than noise: an effect that others resemble is left out, and the search goes on
  /// without it; one effect after the other, until a better model is found. Whether one was.
  bool find_without_each();

  /// What is left is more than noise: in the place of all that was found, a mass with a motion of its own.
  /// Whether one is better. Until then no candidate is one. Unless something is certainly missing, only one
  /// is sought that would be certain.
  bool find_attached_mass(bool certainly_missing);
  /// Whether one stands among what was found.
  bool has_attached_mass() const;
  /// Whether it is one of which the cart's motion says how it swings, and the evidence against all that stood
  /// before is overwhelming.
  bool has_certain_attached_mass() const;
  /// Back to what stood before it was sought.
  void give_up_attached_mass();

  /// What a search has to beat: the objective of another model, of all training data and of the screening
  /// subset.
  struct Goal {
    double objective = std::numeric_limits<double>::infinity();
    double on_subset = std::numeric_limits<double>::infinity();
  };
  /// After something was taken out for good: looks for what can stand in its place. Given up where the goal
  /// is out of reach.
  void find_again(const Goal& goal);
  void find_again() { find_again(Goal{}); }
  /// No candidate from now on.
  void exclude(const std::vector<std::size_t>& effects) { withdrawn_.insert(effects.begin(), effects.end()); }

  /// A number of the plant file that was not found to be off stays as it is from now on.
  void hold(std::size_t number);

  /// Takes an effect out, for good, and before it what cannot be without it. What went.
  std::vector<std::size_t> withdraw(std::size_t effect);

  const Hypothesis& given() const { return given_; }
  const Hypothesis& current() const { return current_; }
  /// In the order in which they were found.
  const std::vector<std::size_t>& found() const { return found_; }
  /// Whether something was dropped in the end that training runs show beyond doubt, for held-out runs spoke
  /// against it.
  bool contradicted() const { return contradicted_; }
  /// What gained a fair share of what this one did, when it was added.
  const std::vector<std::size_t>& similar_effects(std::size_t effect) { return similar_effects_[effect]; }
  /// Where model and data disagreed before this one was added.
  const std::string& where(std::size_t effect) const {
    static const std::string nowhere;
    const auto at = where_.find(effect);
    return at == where_.end() ? nowhere : at->second;
  }
  /// The best effects of the first round, each fitted by itself.
  std::vector<std::pair<std::size_t, Hypothesis>>& finalists() { return finalists_; }
  /// What one of these saved, of the plant file as given.
  double finalist_evidence(std::size_t effect) const { return finalist_evidence_.at(effect); }

 private:
  /// An effect that might be added, and where its fits begin.
  struct Candidate {
    std::size_t effect = 0;
    std::vector<FitResult> starts;
  };

  /// A candidate after a few steps on a part of the data, and what it saves beyond its price.
  struct ScreenedCandidate {
    std::size_t effect = 0;
    Hypothesis hypothesis;
    double gain = 0.0;
  };

  /// An effect that might be added, and what it saves beyond its price.
  struct Finalist {
    std::size_t effect = 0;
    Hypothesis hypothesis;
    double score = 0.0;
  };

  /// What was found before an effect was added that held-out runs spoke against.
  struct Checkpoint {
    Hypothesis hypothesis;
    std::vector<std::size_t> found;
  };

  /// `best_of_last_round`: of the usual ones, the few that gained most in the last round.
  enum class Candidates { usual, attached_masses, driven_masses, best_of_last_round };

  std::vector<std::size_t> open_candidates(Candidates which) const;
  /// A candidate that promises less is not screened: the least evidence is out of its reach.
  double least_predicted_gain() const;
  /// A candidate, or a pair, that gains less on the screening subset is not fitted completely.
  double least_screened_gain() const;
  /// Notes a candidate of the first round, in the place of an earlier note.
  void note_candidate(std::size_t effect, double gain);
  /// Those that promise a share of what the best one does, some of the others, and all that cannot promise. A
  /// promise is kept within a factor of a few (measured on the matrix), so that the best is among them.
  std::vector<Candidate> promising_candidates(const Hypothesis& from,
                                              const std::vector<std::size_t>& candidates, int round);

  double penalty_of(std::size_t effect) const;
  /// What the parameters must save that one hypothesis has beyond the other; negative where it has fewer.
  double penalty_of_change(const Hypothesis& from, const Hypothesis& to) const;
  /// What the fits made so far say of a change to a model with what it brings. Prices, and what else the
  /// change asks for, are the caller's.
  Evidence evidence_of(Change change, const Hypothesis& from, const Hypothesis& to,
                       const std::vector<std::size_t>& brought) const;
  /// The decision on a change to `h`, with the fits that it waits for made on the way: they may bring `h`
  /// further, and give `current_` less noise.
  Decision decided(Evidence& evidence, Hypothesis& h, std::size_t effect);
  /// Fits until that gains nothing more. Much noise hides what a poor fit leaves, and each gives way to the
  /// other by and by.
  void converge(Hypothesis& h);
  /// By how much `h` simulates held-out segments worse than `current_` does, and training segments if these
  /// count too: while more is missing, one and the other come out better or worse by half.
  SimulationChange change_of_simulation(Hypothesis& h, bool of_training_too);
  /// Whether the hypothesis of now does.
  bool explains_more_than(Hypothesis& other);
  /// What held-out runs spoke against while more was missing must have them on its side in the end, or all
  /// that was added since goes.
  void resolve_doubt();
  /// Gives the simpler hypothesis the richer one's noise to start from, so that a better estimate of the
  /// noise is not taken for an effect. What `current_` becomes is at least as good as before.
  void equalise_noise(const Hypothesis& richer);
  /// Where a hypothesis and the data disagree most: in which equation, with what it goes, and when.
  std::string locate(const Hypothesis& h) const;
  void record_trial(int round, std::size_t effect, const Hypothesis& h, const Improvement& improvement);
  void record_step();

  /// Adds effects one at a time, the best first, for as long as the data ask for one. `with_low_noise`: as
  /// they show with little noise, for much noise can account for the whole of an effect. `goal`: as in
  /// find_again().
  /// `first`: the candidates of the first round.
  void select_forward(int first_round, int last_round, bool with_low_noise, const Goal& goal,
                      Candidates first = Candidates::usual);
  /// Whether the goal is out of reach of the best of these, and of the rounds after it.
  static bool is_out_of_reach_of(const std::vector<ScreenedCandidate>& screened, const Goal& goal,
                                 int rounds_left);
  /// One round: whether one of these was added.
  bool add_best_of(const std::vector<ScreenedCandidate>& screened, int round, bool with_low_noise);
  /// How far the work is.
  static double share_done(int round);
  /// All promising candidates.
  std::vector<ScreenedCandidate> screen(int round, bool with_low_noise, Candidates which);
  /// In the order of what they gain, the best first.
  static std::vector<const ScreenedCandidate*> by_gain(const std::vector<ScreenedCandidate>& screened);
  /// The best of them fitted in full: those that the data believe, or, where there are none, those that only
  /// held-out runs speak against.
  std::vector<Finalist> fit_finalists(int round, const std::vector<ScreenedCandidate>& screened,
                                      bool with_low_noise, double done);
  /// Fits one of these in full, and decides on it.
  Decision try_finalist(int round, bool with_low_noise, Finalist& finalist);
  /// The one with the largest score. Close ones are fitted to the end first, for a fit that stopped a little
  /// early is no reason. Scores that are equal then leave it to the held-out runs, and where those say the
  /// same, to the plainer effect.
  std::size_t choose(std::vector<Finalist>& accepted);
  void take(int round, Finalist& best, const std::vector<ScreenedCandidate>& screened);
  /// What was the best name while another effect was still missing need not be the best beside it: each but
  /// the last is exchanged for what had resembled it, where that does better now, or as well and is plainer.
  /// Whether one was.
  bool exchange();
  /// Dry friction in one direction only is Coulomb friction with a constant force as large. A Stribeck curve
  /// whose velocity is far above the motion is Coulomb friction.
  static bool is_contained_in(std::size_t part, std::size_t effect);
  /// What an effect that the plant file lacks may be in plain words, with the values at which it is nearly
  /// the same force.
  struct Simpler {
    std::size_t effect = 0;
    std::vector<PlantEffect> others;
  };
  /// That dry friction acts in one direction only, exactly, would be chance: it is Coulomb friction and a
  /// constant force. A spring whose middle the cart is nowhere near is a constant force.
  std::vector<Simpler> simpler_forms() const;
  /// Puts one of these in the place of what was found, where the data bear the change of parameters out.
  /// Whether it did.
  bool simplify();
  /// Two effects can hide each other, so that a third, which resembles both, is found instead. Every pair of
  /// these is tried in the place of what was found of them, once. Whether one is better.
  bool try_pairs(const std::vector<std::pair<std::size_t, Hypothesis>>& contenders);
  /// Searches without this effect, and takes what is found if that is better. Whether it is.
  bool find_without(std::size_t effect);
  /// Backward deletion: what is no longer needed once others are there goes.
  void eliminate_backward();
  /// Whether it holds of another effect that was found now, and no longer with `h`.
  bool bends_another(const Hypothesis& h, std::size_t effect, Search::Holds holds) const;
  bool is_found(std::size_t effect) const;

  Search& search_;
  const SelectionPolicy& policy_;
  const SearchBudget& budget_;
  const DiagnosisOptions& options_;
  Diagnosis& record_;
  Hypothesis given_, current_;
  std::vector<std::size_t> found_;
  std::optional<Checkpoint> checkpoint_;
  std::optional<Checkpoint> without_attached_mass_;
  bool contradicted_ = false;
  std::set<std::size_t> withdrawn_;
  std::set<std::pair<std::size_t, std::size_t>> exchanged_;   ///< tried already
  std::set<std::pair<std::size_t, std::size_t>> simplified_;  ///< tried already, beside so many
  std::map<std::size_t, std::vector<std::size_t>> similar_effects_;
  std::map<std::size_t, std::string> where_;
  std::vector<std::pair<std::size_t, Hypothesis>> finalists_;
  std::map<std::size_t, double> finalist_evidence_;
  std::vector<std::pair<std::size_t, Hypothesis>> resembling_;  ///< screened, of the first round
  std::set<std::pair<std::size_t, std::size_t>> paired_;        ///< tried already
  std::set<std::size_t> best_of_last_round_;                    ///< of the usual candidates
};

}  // namespace upright
