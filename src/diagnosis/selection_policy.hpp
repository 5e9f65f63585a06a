// What decides in a diagnosis: when an effect is believed, dropped, exchanged or declared indistinguishable,
// what the residual tests tolerate, and what is believed of parameters beforehand. What bounds the work
// instead stands in search_budget.hpp.
//
// Evidence is the fall of minus twice the log likelihood: 2 ln of how many times more likely the data become.
// A t value and a certainty are in standard errors. Each number says why it is as it is, and what its value
// rests on. "Chosen" means chosen, not measured by itself; all of them together are measured in
// docs/results/diagnosis-matrix.md.
#pragma once

#include <array>
#include <cstddef>

#include "estimation/smoother.hpp"

namespace upright {

/// When an effect belongs to the model.
struct AcceptancePolicy {
  /// [evidence] Saved on the training data, beyond the price of its parameters. About 30 candidates with up
  /// to three parameters are tried; 25 keeps chance below one in a thousand when noise is white. From that
  /// count.
  double least_evidence = 25.0;
  /// [standard errors] Of the saving per quarter of a second, which stays honest where the noise is not
  /// white. Three are one in 700 by chance. Chosen.
  double least_t = 3.0;
  /// [evidence] So large that coloured noise cannot have made it, however few the segments are that hold it.
  /// Chosen.
  double overwhelming_evidence = 1000.0;
  /// [robust standard errors] The size of an effect from nothing. As much as evidence of 16. Chosen.
  double least_certainty = 4.0;
  /// [evidence] Each parameter beyond the first must save this on top: a simpler effect that does nearly as
  /// well is preferred. Chosen.
  double parameter_price = 10.0;
  /// [evidence] By which two do equally well: the plainer one is taken. Odds of 7 to 1. Chosen.
  double equally_good_evidence = 4.0;
  /// [evidence] Held-out runs that do not excite the effect say nothing: 1.4 are odds of 2 to 1 against it.
  /// An effect with evidence 448 had been refused at odds of 1.05 to 1.
  double held_out_indifference = 1.4;
  /// [evidence] Training and held-out runs both say so: each at least. Weak effects in one short run were
  /// missed without this rule (fresh seeds of the matrix).
  double least_evidence_of_each = 8.0;
  /// [evidence] And both together. Above `least_evidence`, for it stands in its place. As above.
  double least_evidence_together = 40.0;
  /// [standard errors] Where t is no more than chance makes, held-out evidence does not add to its square:
  /// one standard error. Chosen. (Held-out evidence of 25 bears out a t of 1.5: seeds 181/83 and 182/114.)
  double chance_t = 1.0;
  /// [standard errors] The least t where nothing but the sensors' noise is left: its evidence needs no other
  /// witness. Chosen.
  double least_t_of_sensors = 1.5;
  /// [sensor noise] A plain simulation of held-out runs that is no further off than this is the sensors'
  /// noise. The matrix's own figure for the floor of a right model.
  double sensors_gap = 1.05;
  /// [1] The evidence of an effect is about the square of its certainty. Evidence of this many times as much
  /// has a fit that has not arrived: it goes on. Less may be noise that is not white. Chosen.
  double unconverged_evidence_ratio = 4.0;
  /// [ln of a ratio] Segments of a plain simulation may be this much further off in the mean. A tenth is
  /// nothing to see. Chosen.
  double worse_simulation_by_chance = 0.1;
  /// [ln of a ratio] And by one standard error of their scatter, which is at least this: while more is
  /// missing, one and the other come out better or worse by half.
  double least_simulation_scatter = 0.5;
  /// [1] What was found stays while it has this share of `least_t`: what is believed already is not dropped
  /// for being a little less certain beside others. Chosen.
  double kept_t_share = 0.7;

  /// [1] What gains this share of what the best does may be the same thing by another name, or half of it.
  /// Chosen.
  double resembling_share = 0.3;
  /// [1] The score of one effect within this share of the best one's is close: both are fitted to the end
  /// before one is chosen, for a fit that stopped a little early is no reason. Chosen.
  double close_score_share = 0.05;
};

/// When a number of the plant file is off, and what an effect cannot be.
struct CorrectionPolicy {
  /// [standard errors] A correction of the plant file is listed from here on. As `least_certainty`. Chosen.
  double least_z = 4.0;
  /// [standard errors] After the last fit, of all runs, a correction with fewer is none: a 95 percent
  /// interval would include nothing.
  double least_certainty_of_all_runs = 2.0;
  /// [prior standard deviations] A coefficient of the plant file that moved less is as believed: its number
  /// is set right, but nothing was missing. Such coefficients move so far from day to day. Chosen.
  double within_belief = 3.0;
  /// [1] In the last fits a prior is this many times as wide: the plant file is believed, if less firmly,
  /// even where the data correct it. Chosen.
  double less_firmly = 4.0;
  /// [encoder steps] An offset of the angle below this does not show. A step and a half. Chosen.
  double least_angle_offset_steps = 1.5;
  /// [1] Bristles that bend over this share of the travel before they slide are a spring by another name.
  /// Bristles of 14 N/m with 5 N of friction had stood for a spring (canterbury data).
  double bristle_share_of_travel = 0.1;
  /// [1] A scale this close to the end of its range is at the end, and stands for something else. Far above
  /// what a bounded step leaves of the way to the end. Chosen.
  double end_of_range = 1e-3;
  /// [ln of a scale] A number of the plant file that is off by more is noted: no data sheet is so far off.
  /// Chosen.
  double doubtful_scale = 0.2;
};

/// When two explanations are not told apart.
struct DistinctionPolicy {
  /// [evidence] Two explanations that differ by less are not told apart: odds of 3000 to 1, or four standard
  /// errors. Chosen.
  double indistinguishable_evidence = 16.0;
  /// [evidence] Or by less than its own scatter, but however much it scatters by this at most: ten times the
  /// above. Chosen.
  double most_scattered_evidence = 160.0;
  /// [standard errors] What counts as within its own scatter: t of the difference below this, a 95 percent
  /// interval.
  double scattered_t = 2.0;
  /// [standard errors] An effect that is fewer from nothing once another is left open may be that other: as
  /// much as evidence of 16.
  double least_distance = 4.0;
  /// [1] And the other must be what takes the certainty away: to less than this share of it. Chosen.
  double least_loss = 0.5;
  /// [1] What has this share of the evidence of the effect that was taken, and is told apart from it, is
  /// named as next best. Chosen, for the reader only: it decides nothing.
  double next_best_share = 1.0 / 3.0;
};

/// What moves, turns or is driven at all, and what an unmodelled force may follow: absolute scales, those of
/// a small cart. Made relative to the plant they would change what is measured now, so they are not here. All
/// chosen.
struct MotionPolicy {
  /// [m/s] Below it the cart's direction is not known.
  double still_cart_mps = 2e-3;
  /// [rad/s] Below it the pendulum's direction is not known.
  double still_pendulum_radps = 0.02;
  /// [V] Below it the voltage's direction is not known.
  double no_voltage_v = 0.02;

  // What an unmodelled force may follow after a reversal: it fades over these times. Two for the cart's
  // motion, since presliding and the drive settle differently.
  double fading_after_motion_s = 0.03;
  double slow_fading_after_motion_s = 0.15;
  double fading_after_voltage_s = 0.05;
  double fading_after_pendulum_s = 0.1;
};

/// What the tests on a fit's innovations measure, and what they tolerate of noise.
struct ResidualPolicy {
  /// [s] Blocks whose innovations are compared: longer than single samples, shorter than a stroke of the
  /// cart. Chosen.
  double block_s = 0.15;
  /// [samples] And at least so many. Chosen.
  double least_block_samples = 20.0;
  /// [samples] The weight a block must have in it to count, for quantised samples that repeat weigh less.
  /// Chosen.
  double least_block_weight = 10.0;
  /// [sensor noise] A block that scatters less is a cart at rest: within a step of its encoder it shows no
  /// noise. Chosen.
  double at_rest = 0.1;
  /// [blocks] Fewer say nothing about how they scatter. Chosen.
  std::size_t least_blocks = 20;
  /// [percent] The large blocks, whose size over the median is the dispersion. Chosen.
  std::size_t large_block_percentile = 95;
  /// [sensor noise] A white force that moves its sensor by less within a block is the sensor's steps by
  /// another name: its pulses are not looked at. Chosen.
  double visible_push = 0.1;
  /// [pulses] Fewer do not show how large they are at most. Chosen.
  std::size_t least_pulses = 30;
  /// [1] Pulses are at most so many times as large as most of them are: half as much again is what chance
  /// makes of so few. Chosen.
  double pulses_by_chance = 1.5;

  /// [sensor noise] A plain simulation that is no further off leaves the sensors' own noise, and nothing is
  /// tested. Chosen.
  double sensors_noise_ratio = 1.15;
  /// [standard errors] What is left goes with something from here on: of the dozen dependences that are
  /// tried, chance makes one in two hundred times. From that count. The certainty of heavy tails too.
  double least_dependence = 3.5;
  /// [1] Dispersion (95th percentile of block rms over its median) of what comes in bursts. Chosen.
  double bursts = 1.6;
  /// [1] Two signs together, each of which chance makes alone: where nothing was missing in the end, of 317
  /// cases of the matrix 7 were as uneven (dispersion) and 12 went with something as much, none did both.
  /// Backlash does.
  double uneven = 1.3;
  /// [standard errors] The other sign.
  double suspected_dependence = 2.5;
  /// [1] No sensor is perfect: a shift of what it shows counts when it accounts for this share of what is
  /// left. 27 to 31 percent where a drive gave way (aau data).
  double least_sensor_share = 0.05;
  /// [kurtosis] Of the pulses of a disturbance that does not come in bursts at most. A Gaussian's is 3.
  /// Chosen.
  double heaviest_tails = 5.5;
  /// [kurtosis] Two signs together, where there is too little to be certain of one: forces that last, and
  /// come in bursts. Sensors that err by much now and then have heavy tails alone, a steady disturbance lasts
  /// alone. (Of 1151 right answers on the matrix one had both, of 15 that missed what no effect describes
  /// five.)
  double heavy_tails = 5.0;
  /// [1] The other sign.
  double rather_slow = 1.4;
  /// [1] What is left may push this many times as hard over a tenth of a second and more as white noise that
  /// accounts for single samples. A disturbance of 10 Hz makes it 1.8 here at most (measured on the matrix),
  /// forces that go with the motion more.
  double slowest = 2.5;
  /// [1] Or less than this: then it is no force, but in what the sensors show, of which a force is the second
  /// derivative. Of play 0.15 to 0.55 is left here, of right answers 1 and more.
  double quickest = 0.6;
  /// [1] With a suspected dependence. Between the two. Chosen.
  double rather_quick = 0.75;
  /// [1] A plain simulation may be this many times as far off as noise like what is left makes it at most;
  /// and held-out runs by as much again. Chosen.
  double most_excess = 2.0;
};

/// Where a residual sits: the features it is held against. For the sentence beside an effect; it decides
/// nothing.
struct LocationPolicy {
  /// [m/s] A cart that is faster moves: only then does its position point at the pitch of a periodic force.
  /// Of a small cart, as the scales below. Chosen.
  double moving_cart_mps = 1e-3;
  /// [s] Means over blocks shorter than an effect takes, longer than the smoother's memory. Chosen.
  double block_s = 0.03;
  /// [1] Ridge on features of unit size, as a share of their number. Chosen.
  double ridge = 0.01;
  /// Rows for each feature, below which nothing is said. Chosen.
  std::size_t rows_per_feature = 4;

  ResidualWalk walk;  ///< of the smoother
};

/// What is believed of parameters before the data are looked at.
struct PriorPolicy {
  /// [1] Standard deviation of a number in a plant file, relative to its value: data sheets and scales are a
  /// few percent off.
  double base_parameter = 0.05;
  /// [1] Friction measured on another day is off by more. As above, chosen.
  double friction = 0.10;
  /// [1] A scale may be wrong, but not by any amount. Chosen.
  double scale = 0.25;
  /// [rad] How well a pendulum at rest shows where down is. Chosen.
  double rest_rad = 1e-3;
  /// [1] Of the typical size of a parameter, the least that its belief refers to. Chosen.
  double least_share_of_typical = 0.2;
  /// [1] Forces at work in a run, whatever the size of the rig: this share of the motor's. A few percent.
  /// Chosen.
  double share_of_motor_force = 0.03;
  /// [1] Dry friction that the motor cannot overcome would hold the cart for good: at most this many times
  /// its force. A fit with 1430 N took minutes.
  double most_share_of_motor_force = 2.0;

  // The exponent of a Stribeck curve: 2 is a Gaussian's, 1 an exponential's. Chosen.
  double shape_mean = 2.0;
  double shape_sigma = 0.5;
  double least_shape = 0.5;
  double most_shape = 4.0;
  /// [m/s] Slowest Stribeck velocity. Chosen.
  double least_stribeck_mps = 1e-3;
  /// [1] And the fastest, as a share of the largest speed: a curve beyond it is not seen. Chosen.
  double most_stribeck_share = 0.5;
  /// [m/s] But this at least. Chosen.
  double fastest_stribeck_mps = 0.02;
  /// [m] Shortest pitch of a force along the track. Chosen.
  double least_pitch_m = 5e-4;
  /// [crests] A force counts as one that repeats when the run passes so many.
  double crests_of_pitch = 3.0;
  /// [m] But a pitch up to this is always looked for. Chosen.
  double least_longest_pitch_m = 0.002;
  /// [m] Standard deviation of the middle of a spring about where the cart is. Of a track of a metre. Chosen.
  double spring_center_m = 0.5;
  // [N/m] Stiffness of bristles. Softer ones are a spring, stiffer ones cannot be told from a rigid contact.
  // Chosen.
  double least_bristle_stiffness_n_per_m = 5.0;
  double most_bristle_stiffness_n_per_m = 3e4;
  /// [s] Longest delay of the input. Chosen.
  double most_delay_s = 0.2;
  /// [sample periods] A lag well below the sample period does not show.
  double least_lag_periods = 0.2;
  /// [s] Longest lag of the motor. Chosen.
  double most_lag_s = 0.5;
  // How far a scale may go. Further, something else is missing: a strong backlash had been explained by 0.3
  // times the mass.
  double least_scale = 0.3;
  double most_scale = 3.0;
};

/// What the runs can show at all.
struct ExcitationPolicy {
  /// [sensor steps] A signal that moves by no more shows nothing. Chosen.
  double least_steps = 30.0;
  /// [m] A third of the runs is held out by how lively they are: speed of the cart, and of the tip of a
  /// pendulum of this length beside it. That of a small rig; it weighs one against the other only. Chosen.
  double arm_m = 0.3;
  /// [s] Speeds are differences over so long, for over one sample they are the encoder's steps. Chosen.
  double speed_window_s = 0.02;
};

struct SelectionPolicy {
  AcceptancePolicy acceptance;
  CorrectionPolicy correction;
  DistinctionPolicy distinction;
  MotionPolicy motion;
  ResidualPolicy residual;
  LocationPolicy location;
  PriorPolicy prior;
  ExcitationPolicy excitation;
};

}  // namespace upright
