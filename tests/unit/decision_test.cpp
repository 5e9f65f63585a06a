// Both sides of every rule that decides whether the data bear out a change of the model.
#include "diagnosis/decision.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "diagnosis/indistinguishable.hpp"

namespace upright {
namespace {

constexpr SelectionPolicy policy;
constexpr AcceptancePolicy p = policy.acceptance;
constexpr SignificancePolicy levels = policy.significance;
constexpr double noticeable = evidence_at(levels.noticeable_z);
constexpr double equally_good = evidence_at(levels.interval_z);
constexpr double infinity = std::numeric_limits<double>::infinity();

double above(double value) {
  return std::nextafter(value, infinity);
}
double below(double value) {
  return std::nextafter(value, -infinity);
}

/// A change that is borne out by no rule but those that the test sets: no fit is missing.
Evidence evidence(Change change, double train, double held, double t_value) {
  Evidence e;
  e.change = change;
  e.improvement = {train, 0.0, held, t_value};
  e.certainty = 10.0;
  e.simulated_segments = SimulationChange{};
  return e;
}

/// An effect that is as well off when the noise is levelled.
Evidence addition(double train, double held, double t_value) {
  Evidence e = evidence(Change::add, train, held, t_value);
  e.at_equal_noise = e.improvement;
  return e;
}

Rule rule_of(const Evidence& e) {
  const Decision decision = decide(e, policy);
  EXPECT_EQ(decision.waits_for, MissingFit::none);
  return decision.rule;
}

MissingFit missing_of(const Evidence& e) {
  const Decision decision = decide(e, policy);
  EXPECT_FALSE(decision.accepted);
  return decision.waits_for;
}

TEST(Addition, MustBePossibleAndLeaveOthersSo) {
  Evidence e = addition(500.0, 0.0, 5.0);
  EXPECT_TRUE(decide(e, policy).accepted);
  e.bends_another = true;
  EXPECT_EQ(rule_of(e), Rule::bends_another);
  e.plausible = false;
  EXPECT_EQ(rule_of(e), Rule::cannot_be);
}

TEST(Addition, NeedsEvidenceBeyondItsPrice) {
  EXPECT_EQ(rule_of(addition(p.min_evidence, 0.0, 5.0)), Rule::shown_throughout);
  EXPECT_EQ(rule_of(addition(below(p.min_evidence), 0.0, 5.0)), Rule::too_little_evidence);
  Evidence priced = addition(p.min_evidence + 20.0, 0.0, 5.0);
  priced.penalty = 20.0;
  EXPECT_EQ(rule_of(priced), Rule::shown_throughout);
  priced.penalty = 21.0;
  EXPECT_EQ(rule_of(priced), Rule::too_little_evidence);
}

TEST(Addition, IsRefusedWhereHeldOutRunsSpeakAgainstIt) {
  EXPECT_EQ(rule_of(addition(500.0, -equally_good, 5.0)), Rule::held_out_against);
  EXPECT_EQ(rule_of(addition(500.0, above(-equally_good), 5.0)), Rule::shown_throughout);
}

TEST(Addition, MustShowAllAlongTheTrainingRuns) {
  EXPECT_EQ(rule_of(addition(500.0, 0.0, levels.noticeable_z)), Rule::chance);
  EXPECT_EQ(rule_of(addition(500.0, 0.0, above(levels.noticeable_z))), Rule::shown_throughout);
}

TEST(Addition, HasHeldOutRunsAsAWitnessOfItsT) {
  Evidence e = addition(500.0, 5.0, 2.0);  // 2^2 + 5 = 3^2
  EXPECT_EQ(rule_of(e), Rule::chance);
  e.improvement.held = 5.01;
  e.at_equal_noise = e.improvement;
  EXPECT_EQ(rule_of(e), Rule::shown_throughout);
}

TEST(Addition, HasNoWitnessWhereTrainingRunsSayNoMoreThanChance) {
  EXPECT_EQ(rule_of(addition(500.0, 1000.0, p.chance_t)), Rule::chance);
  EXPECT_EQ(rule_of(addition(500.0, 1000.0, above(p.chance_t))), Rule::borne_out);
}

TEST(Addition, IsBorneOutByTrainingAndHeldOutRuns) {
  EXPECT_EQ(rule_of(addition(noticeable, 1000.0, 5.0)), Rule::too_little_evidence);
  EXPECT_EQ(rule_of(addition(above(noticeable), 1000.0, 5.0)), Rule::borne_out);
  EXPECT_EQ(rule_of(addition(1000.0, noticeable, 5.0)), Rule::shown_throughout);
  EXPECT_EQ(rule_of(addition(1000.0, above(noticeable), 5.0)), Rule::borne_out);
  const double half = 0.5 * p.min_evidence;
  EXPECT_EQ(rule_of(addition(half, half, 5.0)), Rule::too_little_evidence);
  EXPECT_EQ(rule_of(addition(half, half + 0.1, 5.0)), Rule::borne_out);
}

TEST(Addition, NeedsNoTWithOverwhelmingEvidence) {
  EXPECT_EQ(rule_of(addition(p.overwhelming_evidence, 0.0, 0.5)), Rule::chance);
  EXPECT_EQ(rule_of(addition(above(p.overwhelming_evidence), 0.0, 0.5)), Rule::overwhelming);
}

TEST(Addition, NeedsNoTWhereNumbersOfThePlantNeedNotBeSoFarOff) {
  Evidence e = addition(500.0, 0.0, 0.5);
  e.improvement.prior = p.min_evidence;
  e.at_equal_noise = e.improvement;
  EXPECT_EQ(rule_of(e), Rule::chance);
  e.improvement.prior = above(p.min_evidence);
  e.at_equal_noise = e.improvement;
  EXPECT_EQ(rule_of(e), Rule::plant_numbers);
}

TEST(Addition, MustBeOfACertainSize) {
  Evidence e = addition(60.0, 0.0, 5.0);  // less than four times the square of the certainty
  e.certainty = levels.certain_z;
  EXPECT_EQ(rule_of(e), Rule::shown_throughout);
  e.certainty = below(levels.certain_z);
  EXPECT_EQ(rule_of(e), Rule::uncertain_size);
  e.is_correction = true;
  EXPECT_EQ(rule_of(e), Rule::shown_throughout);
}

TEST(Addition, GoesOnWhereItsFitIsLessCertainThanItsEvidence) {
  Evidence e = addition(evidence_at(3.0 * levels.clear_ratio), 0.0, 5.0);
  e.certainty = 3.0;
  EXPECT_EQ(missing_of(e), MissingFit::converged);
  e.certainty_converged = below(levels.certain_z);
  EXPECT_EQ(rule_of(e), Rule::uncertain_size);
  e.certainty_converged = levels.certain_z;
  EXPECT_EQ(rule_of(e), Rule::shown_throughout);
  e.certainty = above(3.0);
  e.certainty_converged.reset();
  EXPECT_EQ(rule_of(e), Rule::uncertain_size);
}

TEST(Addition, MayBeMadeCertainByAllRuns) {
  Evidence e = addition(21.0, 20.0, 5.0);
  e.certainty = 3.0;
  EXPECT_EQ(missing_of(e), MissingFit::all_runs);
  e.certainty_of_all_runs = levels.certain_z;
  EXPECT_EQ(rule_of(e), Rule::borne_out);
  e.certainty_of_all_runs = below(levels.certain_z);
  EXPECT_EQ(rule_of(e), Rule::uncertain_size);
}

TEST(SimulationChange, IsTheMeanLogarithmOverTheSegments) {
  const SimulationChange change = simulation_change({1.0, 2.0, 4.0, 8.0}, {2.0, 2.0, 8.0, 8.0});
  EXPECT_EQ(change.segments, 4u);
  EXPECT_NEAR(change.mean, std::log(2.0) / 2.0, 1e-12);
  EXPECT_NEAR(change.scatter, std::log(2.0) / 2.0, 1e-12);
  // 2.132 is the 95th percentile of Student's t with four degrees of freedom.
  const double usual = p.usual_simulation_scatter;
  const double standard_error = std::sqrt((usual * usual + 4.0 * change.scatter * change.scatter) / 16.0);
  EXPECT_NEAR(change.by_chance(policy), 2.132 * standard_error, 1e-3);
  EXPECT_EQ(simulation_change({}, {}).by_chance(policy), 0.0) << "no data are held out";
  const double diverged = std::numeric_limits<double>::infinity();
  EXPECT_EQ(simulation_change({diverged, diverged}, {diverged, diverged}).mean, 0.0);
  EXPECT_LT(simulation_change({diverged, diverged}, {1.0, 2.0}).mean, -10.0);
  EXPECT_GT(simulation_change({1.0, 2.0}, {diverged, diverged}).mean, 10.0);
}

TEST(SimulationChange, OfOneSegmentDoesNotOutweighTheOthers) {
  const SimulationChange change = simulation_change({1.0, 1.0, 1.0, 1.0, 1.0}, {3.0, 0.8, 0.8, 0.8, 0.8});
  EXPECT_LT(change.mean - change.by_chance(policy), 0.0);
}

TEST(Addition, MustSimulateAsWellAsSegmentsCanShow) {
  const auto rule = [](std::size_t segments, double scatter, double mean) {
    Evidence e = addition(500.0, 0.0, 5.0);
    e.simulated_segments = SimulationChange{segments, mean, scatter};
    return rule_of(e);
  };
  EXPECT_EQ(rule(0, 0.0, 100.0), Rule::shown_throughout) << "no data are held out";
  const auto limit = [](std::size_t segments, double scatter) {
    return levels.visible_change + SimulationChange{segments, 0.0, scatter}.by_chance(policy);
  };
  EXPECT_EQ(rule(4, 0.1, limit(4, 0.1)), Rule::simulates_worse);
  EXPECT_EQ(rule(4, 0.1, below(limit(4, 0.1))), Rule::shown_throughout);
  EXPECT_EQ(rule(4, 2.0, limit(4, 0.1)), Rule::shown_throughout) << "four segments that scatter show less";
  EXPECT_EQ(rule(4, 2.0, limit(4, 2.0)), Rule::simulates_worse);
  EXPECT_EQ(rule(1, 0.0, 1.0), Rule::shown_throughout) << "one segment shows little";
}

TEST(Addition, IsFollowedInDoubtWithOverwhelmingEvidenceOnly) {
  const auto against = [](double train, double t_value) { return rule_of(addition(train, -5.0, t_value)); };
  EXPECT_EQ(against(p.overwhelming_evidence, 5.0), Rule::held_out_against);
  EXPECT_EQ(against(above(p.overwhelming_evidence), 5.0), Rule::held_out_in_doubt);
  EXPECT_EQ(against(2000.0, levels.noticeable_z), Rule::held_out_against);
  EXPECT_EQ(against(2000.0, above(levels.noticeable_z)), Rule::held_out_in_doubt);
  Evidence uncertain = addition(2000.0, -5.0, 5.0);
  uncertain.certainty = 1.0;
  uncertain.certainty_converged = 1.0;
  EXPECT_EQ(rule_of(uncertain), Rule::uncertain_size);

  const auto worse = [](double train) {
    Evidence e = addition(train, 0.0, 5.0);
    e.simulated_segments = SimulationChange{4, 10.0, 0.0};
    return decide(e, policy);
  };
  EXPECT_EQ(worse(p.overwhelming_evidence).rule, Rule::simulates_worse);
  EXPECT_FALSE(worse(p.overwhelming_evidence).in_doubt());
  EXPECT_EQ(worse(above(p.overwhelming_evidence)).rule, Rule::simulation_in_doubt);
  EXPECT_TRUE(worse(above(p.overwhelming_evidence)).in_doubt());
  EXPECT_FALSE(worse(above(p.overwhelming_evidence)).accepted);
}

TEST(Addition, CountsOverTheModelWithTheSameNoise) {
  Evidence e = evidence(Change::add, below(p.overwhelming_evidence), 0.0, 5.0);
  EXPECT_EQ(missing_of(e), MissingFit::equal_noise);
  e.at_equal_noise = Improvement{10.0, 0.0, 0.0, 5.0};
  EXPECT_EQ(rule_of(e), Rule::too_little_evidence);
  e = evidence(Change::add, p.overwhelming_evidence, 0.0, 5.0);
  EXPECT_EQ(rule_of(e), Rule::shown_throughout);
  e.with_low_noise = true;
  EXPECT_EQ(missing_of(e), MissingFit::equal_noise);
}

TEST(Addition, WaitsForTheSimulationsThatARuleAsksFor) {
  Evidence e = addition(500.0, 0.0, 5.0);
  e.simulated_segments.reset();
  EXPECT_EQ(missing_of(e), MissingFit::simulated_segments);
}

TEST(Exchange, IsForWhatIsBetter) {
  const double threshold = evidence_at(levels.certain_z);
  EXPECT_EQ(rule_of(evidence(Change::exchange, threshold, 1.0, 0.0)), Rule::no_better);
  EXPECT_EQ(rule_of(evidence(Change::exchange, above(threshold), 1.0, 0.0)), Rule::better);
  EXPECT_EQ(rule_of(evidence(Change::exchange, 100.0, 0.0, 0.0)), Rule::no_better);
  EXPECT_EQ(rule_of(evidence(Change::exchange, 100.0, above(0.0), 0.0)), Rule::better);
  Evidence cheaper = evidence(Change::exchange, 0.0, 1.0, 0.0);
  cheaper.penalty_saved = 20.0;
  EXPECT_EQ(rule_of(cheaper), Rule::better);
}

TEST(Exchange, IsForWhatIsAsGoodAndPlainer) {
  const auto rule = [](double train, double held) {
    Evidence e = evidence(Change::exchange, train, held, 0.0);
    e.is_plainer = true;
    return rule_of(e);
  };
  EXPECT_EQ(rule(-equally_good, 1.0), Rule::no_better);
  EXPECT_EQ(rule(above(-equally_good), 1.0), Rule::plainer);
  EXPECT_EQ(rule(1.0, -equally_good), Rule::no_better);
  EXPECT_EQ(rule(1.0, above(-equally_good)), Rule::plainer);
  EXPECT_EQ(rule(-0.5 * equally_good, -0.5 * equally_good), Rule::no_better);
  EXPECT_EQ(rule(-0.5 * equally_good, 0.1 - 0.5 * equally_good), Rule::plainer);
}

TEST(Exchange, AsksThatTheSubstituteIsPossibleAndCertain) {
  Evidence e = evidence(Change::exchange, 100.0, 1.0, 0.0);
  e.certainty = levels.certain_z;
  EXPECT_EQ(rule_of(e), Rule::better);
  e.certainty = below(levels.certain_z);
  EXPECT_EQ(rule_of(e), Rule::uncertain_size);
  e.plausible = false;
  EXPECT_EQ(rule_of(e), Rule::cannot_be);
  e = evidence(Change::exchange, 100.0, 1.0, 0.0);
  e.simulated_segments = SimulationChange{4, 10.0, 0.0};
  EXPECT_EQ(rule_of(e), Rule::simulates_worse);
}

TEST(Simplification, MustSaveWhatItsParametersCost) {
  Evidence e = evidence(Change::simplify, 10.0, 0.0, 0.0);
  e.penalty = 10.0;
  EXPECT_EQ(rule_of(e), Rule::no_better);
  e.improvement.train = above(10.0);
  EXPECT_EQ(rule_of(e), Rule::plainer);
  e.improvement.held = -equally_good;
  EXPECT_EQ(rule_of(e), Rule::held_out_against);
  e.improvement.held = above(-equally_good);
  EXPECT_EQ(rule_of(e), Rule::plainer);
}

TEST(Pair, NeedsEvidenceAndNoHeldOutRunsAgainstIt) {
  EXPECT_EQ(rule_of(evidence(Change::pair, below(p.min_evidence), 0.0, 0.0)), Rule::too_little_evidence);
  EXPECT_EQ(rule_of(evidence(Change::pair, p.min_evidence, 0.0, 0.0)), Rule::better);
  EXPECT_EQ(rule_of(evidence(Change::pair, p.min_evidence, below(0.0), 0.0)), Rule::held_out_against);
}

TEST(Keeping, NeedsALittleLessTThanAdding) {
  const double min_t = levels.interval_z;
  EXPECT_EQ(rule_of(evidence(Change::keep, 100.0, 0.0, min_t)), Rule::chance);
  EXPECT_EQ(rule_of(evidence(Change::keep, 100.0, 0.0, above(min_t))), Rule::still_shown);
  EXPECT_EQ(rule_of(evidence(Change::keep, p.min_evidence, 0.0, 2.5)), Rule::chance);
  EXPECT_EQ(rule_of(evidence(Change::keep, above(p.min_evidence), 0.0, 2.5)), Rule::still_shown);
  EXPECT_EQ(rule_of(evidence(Change::keep, 20.0, 21.0, 5.0)), Rule::borne_out);
}

TEST(Keeping, IsForWhatAnotherNeeds) {
  Evidence e = evidence(Change::keep, 1.0, 0.0, 0.0);
  EXPECT_EQ(rule_of(e), Rule::too_little_evidence);
  e.bends_another = true;
  EXPECT_EQ(rule_of(e), Rule::needed_by_another);
}

TEST(WhatWasAddedInDoubt, MustHaveHeldOutRunsOnItsSideInTheEnd) {
  EXPECT_EQ(rule_of(evidence(Change::trust_added, 5000.0, 0.0, 5.0)), Rule::held_out_against);
  Evidence e = evidence(Change::trust_added, 5000.0, above(0.0), 5.0);
  EXPECT_EQ(rule_of(e), Rule::held_out_agree);
  e.simulated_segments = SimulationChange{4, 10.0, 0.0};
  EXPECT_EQ(rule_of(e), Rule::simulates_worse);
}

TEST(Numbers, ThatDecideAreFewerThanTwenty) {
  constexpr std::size_t of_levels = sizeof(SignificancePolicy) + sizeof(AcceptancePolicy) +
                                    sizeof(CorrectionPolicy) + sizeof(AdequacyPolicy);
  // The largest usual disturbances (two members of PriorPolicy), and the least motion (of ExcitationPolicy).
  constexpr std::size_t others = 3;
  EXPECT_LT(of_levels / sizeof(double) + others, 20u);
}

TEST(Rules, HaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  const int count = static_cast<int>(Rule::simulation_in_doubt) + 1;
  for (int i = 0; i < count; ++i) names.insert(name_of(static_cast<Rule>(i)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(count));
  EXPECT_FALSE(names.contains(""));
}

TEST(Place, IsBetterByMoreThanIsEquallyGood) {
  EXPECT_FALSE(is_better_optimum(equally_good, levels));
  EXPECT_TRUE(is_better_optimum(above(equally_good), levels));
}

/// A spring has two parameters, a force one: it is the plainer.
const std::size_t force = effect_number("constant_force"), spring = effect_number("cable_spring");

TEST(BestContender, HasTheLargestScoreUnlessOthersAreEqual) {
  EXPECT_EQ(best_of({{spring, 104.0, 0.0}, {force, 100.0, 0.0}}, levels), 0u);
  EXPECT_EQ(best_of({{spring, below(104.0), 0.0}, {force, 100.0, 0.0}}, levels), 1u);
}

TEST(BestContender, IsChosenByHeldOutRunsAmongEquals) {
  EXPECT_EQ(best_of({{spring, 100.0, 4.1}, {force, 100.0, 0.0}}, levels), 0u);
  EXPECT_EQ(best_of({{spring, 100.0, 4.0}, {force, 100.0, 0.0}}, levels), 1u);
}

TEST(Indistinguishable, IsWhatLosesLittleEvidence) {
  const double certain = evidence_at(levels.certain_z);
  EXPECT_TRUE(is_indistinguishable(below(certain), 100.0, policy));
  EXPECT_FALSE(is_indistinguishable(certain, 100.0, policy));
  EXPECT_TRUE(is_indistinguishable(100.0, below(levels.interval_z), policy));
  EXPECT_FALSE(is_indistinguishable(100.0, levels.interval_z, policy));
  EXPECT_TRUE(is_indistinguishable(below(p.overwhelming_evidence), 0.0, policy));
  EXPECT_FALSE(is_indistinguishable(p.overwhelming_evidence, 0.0, policy));
}

TEST(Alternative, TakesTheCertaintyOfAnEffectAway) {
  EXPECT_TRUE(reduces_certainty(below(levels.certain_z), 100.0, levels));
  EXPECT_FALSE(reduces_certainty(levels.certain_z, 100.0, levels));
  EXPECT_TRUE(reduces_certainty(below(3.0), 6.0, levels)) << "it takes more than it leaves";
  EXPECT_FALSE(reduces_certainty(3.0, 6.0, levels));
}

TEST(SearchWithoutAnEffect, EndsWhereItIsOutOfReach) {
  EXPECT_FALSE(is_out_of_reach(30.0, 10.0, 3));
  EXPECT_TRUE(is_out_of_reach(30.1, 10.0, 3));
  EXPECT_FALSE(is_out_of_reach(-0.1, 0.0, 2));
  EXPECT_FALSE(is_out_of_reach(-0.1, 10.0, 0));
  EXPECT_TRUE(is_out_of_reach(0.1, 10.0, 0));
}

}  // namespace
}  // namespace upright
