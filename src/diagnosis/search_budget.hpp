// The limits of a diagnosis's work: how many candidates, rounds, steps and data are used. Larger limits may
// find more and take longer. No effect is accepted because of them (selection_policy.hpp decides that).
//
// FitOptions limits a single fit, and `default_search_bound` limits how often a search may follow each
// sample. Each comment gives the unit, the reason and the origin of the value. "Chosen" means that the value
// was not measured by itself; docs/results/diagnosis-matrix.md measures the time of a diagnosis.
#pragma once

#include <cstddef>

namespace upright {

struct SearchBudget {
  // Samples: the diagnosis works on a part of them, where the record is finer than the motion.
  /// [s] From sample to sample. Fewer samples say less of weak effects: 8 ms took 0.75 of the time in four
  /// laboratory cases, for half of the samples. The numbers of the model that was found are fitted to all
  /// samples. Chosen.
  double thinned_period_s = 4e-3;
  /// [of the noise of the cart's sensor] By how much the mean of some voltages may move the cart. A
  /// controller answers the noise with its voltage, so that this does not average out: 1 biased estimates
  /// from records of closed loops beyond their intervals. A hundredth of that was chosen.
  double thinned_shift = 0.01;
  /// [1] Thinning pays if the record has this many times as many samples: its numbers are fitted to all
  /// samples in the end, which costs a part of what was saved. Chosen.
  double min_thinning_ratio = 1.5;
  /// [samples] At least so many stay. Sensor noise averages out over samples, so that weak effects show less
  /// in fewer; and a diagnosis of fewer takes seconds anyway. Chosen.
  std::size_t min_thinned_samples = 5000;

  // Screening: the part of the training data that is used first.
  /// [segments] The least number of screening segments. Runs differ, but the segments of a run are similar,
  /// so only every few are used. From twelve segments on this saves half of the work: six 10 s runs with two
  /// effects took 35 s of processor time instead of 62 s (with two more changes, seed 41/3).
  std::size_t min_screening_segments = 6;
  /// [segments] The largest stride between screening segments. Chosen.
  std::size_t max_screening_stride = 3;
  /// [steps] The steps of a candidate's fit to the screening segments, from each of its starts. Chosen.
  int screening_steps = 4;
  /// [steps] The steps of the fit without the candidate. It has converged on all the data and needs only a
  /// few, because a part of the data can give slightly different values. Chosen.
  int screening_reference_steps = 2;
  /// [1] If something is certainly missing, screening segments that are less than this share of the training
  /// data suffice: the candidates are not screened again on all of them. Only the segment with the largest
  /// voltage is added, where the others could not show a saturation. Chosen.
  double certain_screening_share = 0.5;

  // Candidates: which are fitted completely.
  /// [1] Candidates whose predicted gain is this share of the best one's are screened. Predictions are right
  /// within a factor of a few. In 23 rounds of 14 matrix cases, the best effect was among the first three in
  /// the order of predicted gain. A candidate whose prediction is below this share of `min_evidence` (in
  /// proportion to the segments) is not screened. If its gain with the noise as it is stays below that, the
  /// noise is not estimated again. Of 174 fits that were accepted in 96 matrix cases, those with a prediction
  /// had promised at least 22.
  double predicted_gain_share = 0.1;
  /// [candidates] The least number that is screened, whatever the best one promises. Well above three, for
  /// the same reason. If a round on a part of the data accepts none, this many are screened on all data. In
  /// 28 of 130 matrix cases there was such a second round. It accepted none either.
  std::size_t min_screened = 8;
  /// [1] A candidate, or a pair in the place of what was found, that gains less than this share of
  /// `min_evidence` on the screening segments, in proportion to their number, is not fitted completely. Below
  /// one, because a few steps do not reach the whole gain. Chosen.
  double min_screening_evidence_share = 0.4;
  /// [1] A candidate that gains less than this share of the best one's gain is not fitted completely either,
  /// because a complete fit would not close the difference. Twelve matrix cases gave the same results with
  /// and without this limit.
  double min_gain_share = 0.05;
  /// [1] Candidates that gain this share of the gain of the best one are similar to it: they may be the same
  /// force, or a part of it. They are tried in its place. One with this share of its evidence is named as
  /// next best. Chosen.
  double resembling_share = 0.3;
  /// [1] If the scores of two effects differ by less than this share, both fits are completed before one is
  /// chosen, because a fit that stopped early must not decide. Chosen.
  double close_score_share = 0.05;
  /// [candidates] The most that are fitted completely in each round. Chosen.
  std::size_t max_finalists = 4;
  /// [candidates] If nothing else explains the data, the pairs of this many candidates of the first round are
  /// tried: 28 pairs. Chosen.
  std::size_t max_resembling = 8;
  /// [rounds] The rounds of each search. Each adds one effect. The matrix hides at most two. Chosen.
  int max_rounds = 4;

  // Fits: how far they are continued.
  /// [steps] The steps of the first fit, of the plant file with little noise. It starts far from its minimum.
  /// Chosen.
  int baseline_restart_steps = 24;
  /// [steps] The steps of a fit of the initial states alone, when held-out data are followed. Chosen.
  int held_out_steps = 6;
  /// [rounds] The noise estimates in a fit of held-out data, in which the parameters stay within what the
  /// training data leave open. Chosen.
  int predictive_noise_rounds = 1;
  /// [steps] The steps of that fit. Chosen.
  int predictive_steps = 4;
  /// [fits] The most further fits of an effect that is less certain than its evidence suggests. A poor fit is
  /// hidden by a large noise estimate; each further fit reduces both. Chosen.
  int max_refits = 6;
  /// [evidence] The least gain of each such fit for another one to follow. Chosen.
  double min_refit_gain = 10.0;
  /// [evidence] Above this evidence, the screening segments decide first whether a fit from less noise could
  /// be better. Below it every difference counts, so all the data are used. Chosen.
  double clear_evidence = 1000.0;
  /// [evidence] Two fits that reach the same minimum in different ways differ by up to this. Chosen.
  double restart_tolerance = 10.0;
  /// [1] A possible replacement that gains this share of the gain of the earlier effect is fitted completely
  /// before the two are compared, because beside the other effects it starts from a wrong size. Chosen.
  double exchange_share = 0.5;
  /// [1] The share of the search's bound that is granted after the bound was reached. The examination of the
  /// result takes about a tenth of a usual search.
  double examination_share = 0.25;

  /// [s] From sample to sample in a quick diagnosis. At 100 Hz the motion of a pendulum of arm's length is
  /// still followed; effects of a few milliseconds are not seen. Chosen.
  double quick_period_s = 10e-3;
  /// [of the noise of the cart's sensor] By how much a mean voltage may move the cart in a quick diagnosis,
  /// which names only what is beyond doubt. Chosen.
  double quick_shift = 1.0;
  /// [segments] The least number of segments on which a quick diagnosis screens. Chosen.
  std::size_t quick_screening_segments = 3;

  // Starts of a force that is periodic along the track.
  /// [samples] The samples of the residual force, evenly spaced. Chosen.
  std::size_t max_residual_samples = 4000;
  /// [samples] Fewer samples show no pitch. Chosen.
  std::size_t min_residual_samples = 50;
  /// [frequencies] Enough for 5 m of track and a pitch of 1 mm. On a longer track (or in another unit) the
  /// shortest pitches are not searched, because the time grows with the travel without limit.
  double max_frequencies = 20000.0;
  /// [pitches] The sines that explain most of the residual force. The noise of this force is not white, so
  /// the right pitch may explain less than several others: the likelihood chooses among them. With two, an
  /// eccentric encoder with an evidence of 170 was not found (seed 20261217, case 148); its pitch came third.
  std::size_t max_pitches = 6;
  /// [pitches] The most of these within a factor of two. The steps of an encoder make many pitches of a few
  /// steps look likely, and these must not keep out all others: the first three were about six steps, where
  /// the true pitch of 579 steps came 192nd (laboratory, seed 20261230, case 73).
  std::size_t max_alike_pitches = 2;

  /// [nodes] The nodes along the travel of a random force of the track. A force that changes within the
  /// hundredth part of the travel is still resolved; the work grows with the cube of the number. Chosen.
  std::size_t track_nodes = 128;

  /// [draws] The noise draws for the floor of a plain simulation. The largest draw is the limit of what noise
  /// can cause. Chosen.
  std::size_t floor_draws = 32;
  /// [effects] The most effects that are named as next best. Chosen for the reader.
  std::size_t max_next_best = 3;
};

}  // namespace upright
