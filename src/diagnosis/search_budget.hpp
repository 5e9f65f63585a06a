// What bounds the work of a diagnosis: how many candidates, rounds, steps and data are looked at. More of any
// of these may find more and takes longer; nothing is believed for it (selection_policy.hpp decides that).
//
// How far a fit goes by itself stands in FitOptions, how often a search may follow each sample at most in
// `default_search_bound`. Each number says why it is as it is, and what its value rests on. "Chosen" means
// chosen, not measured by itself; the whole is measured in docs/results/diagnosis-matrix.md (time of a
// diagnosis).
#pragma once

#include <cstddef>

namespace upright {

struct SearchBudget {
  // Screening: which part of the training data is looked at first.
  /// [segments] Runs differ, segments of a run are alike: every few are taken in turn, but so many at least.
  /// From twelve segments on it saves half: six 10 s runs with two effects took 35 s of processor time
  /// instead of 62 s (with two more changes, seed 41/3).
  std::size_t least_screening_segments = 6;
  /// [segments] And every third at most. Chosen.
  std::size_t most_screening_stride = 3;
  /// [steps] Of a candidate's fit on that part, from each of its starts. Chosen.
  int screening_steps = 4;
  /// [steps] Of the fit without the candidate, which has converged on all of the data: a few, for the part
  /// may say a little else. Chosen.
  int screening_reference_steps = 2;
  /// [1] What certainly is missing shows on a smaller share of the training data too: then they are not all
  /// screened once more. Chosen.
  double certain_screening_share = 0.5;

  // Candidates: which are fitted in full.
  /// [1] Candidates are screened that promise this share of what the best does. A promise is kept within a
  /// factor of a few; of 23 rounds of 14 matrix cases the best was among the first three of that order.
  double promise_share = 0.1;
  /// Screened however little they promise. As above: well more than three.
  std::size_t least_screened = 8;
  /// [1] Of `least_evidence`, in proportion to the screening subset: what gains less there is not fitted in
  /// full. Below one, since a few steps do not reach all. Chosen.
  double least_screening_evidence_share = 0.4;
  /// [1] Nor what gains less than this share of what the best does: a whole fit does not make up for it.
  /// Twelve matrix cases gave the same results with it.
  double least_gain_share = 0.05;
  /// Candidates that are fitted in full in each round. Chosen.
  std::size_t most_finalists = 4;
  /// Candidates of the first round whose pairs are tried where nothing else explains: 28 pairs. Chosen.
  std::size_t most_resembling = 8;
  /// Rounds of each way to search, each of which adds one effect. Hidden are two at most on the matrix.
  /// Chosen.
  int most_rounds = 4;

  // Fits: how far they go.
  /// [steps] Of the plant file's fit from less noise, the first of all: it starts far off. Chosen.
  int baseline_restart_steps = 24;
  /// [steps] Of the initial states alone, when held-out data are followed. Chosen.
  int held_out_steps = 6;
  /// [rounds, steps] Of a fit of held-out data within what the training data leave open. Chosen.
  int predictive_noise_rounds = 1;
  int predictive_steps = 4;
  /// [turns] Fits of an effect that is less certain than its evidence says: much noise hides what a poor fit
  /// leaves, and each gives way to the other by and by. Chosen.
  int most_turns = 6;
  /// [evidence] While each gains this. Chosen.
  double least_turn_gain = 10.0;
  /// [evidence] Above it, whether a fit from less noise may find better is asked of the screening subset
  /// first; below, every bit of evidence counts. Chosen.
  double clear_evidence = 1000.0;
  /// [evidence] Another way to the same place makes an objective differ by this. Chosen.
  double same_place = 10.0;
  /// [1] What gains this share of what the effect it may stand for gained is fitted to the end before it is
  /// compared: beside the others it starts at the wrong size. Chosen.
  double exchange_share = 0.5;
  /// [1] Of the search's bound, granted after it was reached: examining what was found takes about a tenth of
  /// a usual search.
  double examination_share = 0.25;

  // Starts of a force that repeats along the track.
  /// [samples] Of the residual force, evenly spaced. Chosen.
  std::size_t most_residual_samples = 4000;
  /// [samples] Fewer show no pitch. Chosen.
  std::size_t least_residual_samples = 50;
  /// As many as 5 m of track need down to a pitch of 1 mm. Over a longer one (or in another unit) the
  /// shortest pitches are not looked for: the time that would take grows with the travel without end.
  double most_frequencies = 20000.0;
  /// Pitches from which to search. Chosen.
  std::size_t most_pitches = 2;

  /// Draws of the noise for the floor of a plain simulation, of which the largest is the most that noise
  /// makes. Chosen.
  std::size_t floor_draws = 32;
  /// Effects that are named as next best at most. Chosen, for the reader.
  std::size_t most_next_best = 3;
};

}  // namespace upright
