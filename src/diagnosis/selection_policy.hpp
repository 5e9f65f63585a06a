// The limits that decide in a diagnosis: when an effect is accepted, dropped, exchanged or declared
// confusable, what the residual tests accept as noise, and the prior distributions of parameters. Limits of
// the work are in search_budget.hpp.
//
// Evidence is the fall of minus twice the log likelihood, that is 2 ln of the likelihood ratio. t values and
// certainties are in standard errors. Each comment gives the unit, the reason and the origin of the value.
// "Chosen" means that the value was not measured by itself; docs/results/diagnosis-matrix.md measures all of
// them together.
//
// Some limits are speeds, voltages, forces or lengths. They hold for a small cart, and policy_for()
// (plant_scale.hpp) scales them to a plant of another size.
//
// scripts/write_reference.py copies the comments and values into docs/reference/diagnosis-rules.md, so each
// member needs a comment of its own that begins with its unit.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "estimation/smoother.hpp"

namespace upright {

/// The levels of significance: one set for all rules. An evidence is compared with the square of a level in
/// standard errors.
struct SignificancePolicy {
  /// [standard errors] The half-width of a 95 % interval: two values that are closer may be the same, and an
  /// effect that is closer to nothing may be nothing. Two fits whose evidence differs by less than its square
  /// fit equally well: odds of 7 to 1.
  double interval_z = 2.0;
  /// [standard errors] A larger difference counts. By chance it occurs once in 700 times. In a prior, the
  /// unit is its standard deviation.
  double noticeable_z = 3.0;
  /// [standard errors] A larger difference is certain. Its square as evidence is odds of 3000 to 1.
  double certain_z = 4.0;
  /// [1] The probability that chance makes a residual test fail, or simulations look worse. A size that the
  /// data would have shown would be shown with one minus this probability. The usual level.
  double level = 0.05;
  /// [1] What is so many times as large is clearly larger, and what is smaller by this factor clearly
  /// smaller. It is the limit of the gap of held-out data, of a simulation beside the largest of the noise
  /// draws, of the slow residual beside white noise (a disturbance of 10 Hz reaches 1.8, measured on the
  /// matrix), and of the standard error beside the one that the evidence of an effect suggests. An effect
  /// stays, even if a force of the place accounts for it, if the held-out error is so many times larger
  /// without it and with a constant force in its place. A curve that lowers this error by more becomes part
  /// of the model. Chosen.
  double clear_ratio = 2.0;
  /// [ln of a ratio] A change of an error by less is not visible: a tenth. A simulation that is further off
  /// than the sensor noise by less leaves nothing to be tested. An effect goes if the simulations of held-out
  /// segments are further off with it by this and by what may be chance. So does the fitted value of a number
  /// that moved further than believed. A curve that lowers the error by more shows that something is missing.
  /// Chosen.
  double visible_change = 0.1;
};

/// The evidence of what is so many standard errors from nothing.
constexpr double evidence_at(double z) {
  return z * z;
}

/// When an effect is added to the model.
struct AcceptancePolicy {
  /// [evidence] The least evidence on the training runs, after the penalty of the parameters. About 30
  /// candidates with up to three parameters are tried. With white noise, 25 keeps a chance result below one
  /// in a thousand diagnoses. Computed from that number of candidates.
  double min_evidence = 25.0;
  /// [evidence] Coloured noise cannot produce this much, even if few segments contain it. Chosen.
  double overwhelming_evidence = 1000.0;
  /// [evidence] Each parameter beyond the first must save this in addition, so a simpler effect that fits
  /// nearly as well is preferred. Chosen.
  double parameter_penalty = 10.0;
  /// [standard errors] Below this t value, held-out evidence is not added to its square: one standard error
  /// is what chance produces. Chosen. (Held-out evidence of 25 confirmed a t of 1.5: seeds 181/83 and
  /// 182/114.)
  double chance_t = 1.0;
  /// [ln of a ratio] The usual scatter, over the simulated segments, of the change of their errors: while
  /// another effect is missing, errors change by half in either direction.
  double usual_simulation_scatter = 0.5;
};

/// What becomes of the numbers of the plant file.
struct CorrectionPolicy {
  /// [1] The factor by which priors are widened in the final fits. The plant file still has weight there, but
  /// less, where the data correct it. Chosen.
  double prior_widening = 4.0;
  /// [encoder steps] A smaller offset of the angle is not visible in the encoder's counts. A sensor without
  /// steps is compared with an encoder of the same noise. Chosen.
  double min_angle_offset_steps = 1.5;
};

/// What the data would have shown.
struct PowerPolicy {
  /// [kinds] Every rig has this friction. If the data would not have shown it at its usual size, they do not
  /// show that nothing is missing.
  std::array<std::string_view, 4> everywhere = {"viscous_friction", "coulomb_friction",
                                                "pivot_viscous_friction", "pivot_coulomb_friction"};
};

/// Which motion counts as motion, and what an unmodelled force may depend on. Speeds, rates and voltages hold
/// for a small cart and are scaled to other plants (plant_scale.hpp). All are chosen.
struct MotionPolicy {
  /// [m/s] Below this speed the direction of the cart is not known.
  double still_cart_mps = 2e-3;
  /// [rad/s] Below this rate the direction of the pendulum is not known.
  double still_pendulum_radps = 0.02;
  /// [V] Below this voltage its sign is not used.
  double no_voltage_v = 0.02;

  /// [s] A force after a reversal of the cart decays over this time, or over the next one: two times, since
  /// presliding and the drive settle differently.
  double fading_after_motion_s = 0.03;
  /// [s] The longer of the two times after a reversal of the cart.
  double slow_fading_after_motion_s = 0.15;
  /// [s] The same after a reversal of the voltage.
  double fading_after_voltage_s = 0.05;
  /// [s] The same after a reversal of the pendulum.
  double fading_after_pendulum_s = 0.1;
};

/// What a residual must reach to count, however certain it is that chance does not make it.
struct AdequacyPolicy {
  /// [1] No sensor is perfect, so a shift of a sensor counts only if it accounts for this share of the
  /// residual. A flexible drive accounted for 27 to 31 percent (aau data).
  double min_sensor_share = 0.05;
  /// [1] A smaller dispersion (95th percentile of block RMS over the median) is too little to count, however
  /// certain. Chosen.
  double min_dispersion = 1.3;
  /// [kurtosis] The same for the kurtosis of short pulses, and of the slow force or torque that a filter
  /// estimates. It is 3 for a Gaussian. Chosen.
  double min_kurtosis = 4.0;
};

/// How the statistics of the innovations are measured.
struct ResidualPolicy {
  /// [s] The length of the blocks of innovations that are compared: longer than single samples, shorter than
  /// a stroke of the cart. Chosen.
  double block_s = 0.15;
  /// [samples] The least number of samples in a block. Chosen.
  double min_block_samples = 20.0;
  /// [samples] The least sum of weights in a block. Repeated quantised samples weigh less than one. Chosen.
  double min_block_weight = 10.0;
  /// [sensor noise] A block with less scatter belongs to a cart at rest: within one encoder step it shows no
  /// noise. Chosen.
  double at_rest = 0.1;
  /// [percent] The percentile of block sizes whose ratio to the median is the dispersion. Chosen.
  std::size_t large_block_percentile = 95;
  /// [sensor noise] A white force that moves its sensor by less within a block is indistinguishable from
  /// encoder steps. Its pulses are not tested. Chosen.
  double visible_push = 0.1;

  /// [draws] From the fitted model, for the p-values of the tests. The smallest p-value is 1/500 then, less
  /// than half of the level divided by the ten tests.
  std::size_t draws = 499;
};

/// How the residual is located: the regression of the residual force on measured quantities. Its result is
/// the sentence beside an effect. It decides nothing.
struct LocationPolicy {
  /// [m/s] A faster cart moves, so its position indicates the pitch of a periodic force. For a small cart,
  /// and scaled to other plants. Chosen.
  double moving_cart_mps = 1e-3;
  /// [s] The length of the blocks over which means are taken: shorter than an effect acts, longer than the
  /// smoother's memory. Chosen.
  double block_s = 0.03;
  /// [1] The ridge on features of unit size, as a share of their number. Chosen.
  double ridge = 0.01;
  /// [rows] The least number of rows for each feature. With fewer, nothing is reported. Chosen.
  std::size_t rows_per_feature = 4;

  /// [s] The length of the stretch in which an effect shows most. Chosen for the reader.
  double shown_s = 0.2;

  ResidualWalk walk;  ///< of the smoother that estimates the residual force
};

/// How far the table of a curve over the position goes on beside the data.
struct CurvePolicy {
  /// [correlation lengths] Where the curve is forgotten: its correlation with the last place is a seventh
  /// there. Chosen.
  double forgotten_lengths = 2.0;
  /// [of the travel] The largest margin on each side, so that most nodes lie where the data are. Chosen.
  double largest_margin = 1.0 / 6.0;
};

/// The prior distributions of parameters.
struct PriorPolicy {
  /// [1] The standard deviation of a base parameter relative to its value in the plant file: data sheets and
  /// scales are a few percent off.
  double base_parameter = 0.05;
  /// [1] The same for friction, which changes more from day to day. Chosen.
  double friction = 0.10;
  /// [1] The same for a scale of a sensor or a gain, which may be wrong, but not by any amount. Chosen.
  double scale = 0.25;
  /// [ln of a scale] A number of the plant file that is further off is named in a note, because no data sheet
  /// is so wrong. Chosen.
  double doubtful_scale = 0.2;
  /// [rad] How accurately a pendulum at rest shows the vertical. Chosen.
  double rest_rad = 1e-3;
  /// [1] Relative priors refer to at least this share of the typical size of a parameter. Chosen.
  double min_share_of_typical = 0.2;
  /// [1] The typical size of forces in a run, as a share of the motor's largest force. Chosen.
  double share_of_motor_force = 0.03;
  /// [1] The most that a usual random force is, as a share of the motor's force. Both are root mean squares,
  /// the motor's in the run that it drives most. A larger one leaves the data unexplained. Chosen.
  double max_random_share = 0.05;
  /// [1] The typical friction of a pivot, as a share of gravity's largest torque (at the natural rate, of
  /// what grows with the rate). A random torque that remains and is larger leaves the data unexplained.
  /// Chosen.
  double share_of_gravity_torque = 0.01;
  /// [1] The most dry friction, as a multiple of the motor's largest force, since the motor must be able to
  /// overcome it. Without this limit a fit with 1430 N took minutes. A spring whose force half a track from
  /// its centre is larger may be a slope of the track's force (place_null.hpp).
  double max_share_of_motor_force = 2.0;

  /// [1] The mean of the exponent of a Stribeck curve: 2 is a Gaussian, 1 an exponential. Chosen.
  double shape_mean = 2.0;
  /// [1] Its standard deviation. Chosen.
  double shape_sigma = 0.5;
  /// [1] The smallest exponent. Chosen.
  double min_shape = 0.5;
  /// [1] The largest exponent. Chosen.
  double max_shape = 4.0;
  /// [m/s] The slowest Stribeck velocity. For a small cart, and scaled to other plants. Chosen.
  double min_stribeck_mps = 1e-3;
  /// [1] The fastest Stribeck velocity, as a share of the largest speed: the data do not show a faster one.
  /// Chosen.
  double max_stribeck_share = 0.5;
  /// [m/s] The fastest Stribeck velocity is at least this. Scaled as the slowest. Chosen.
  double fastest_stribeck_mps = 0.02;
  /// [m] The shortest pitch of a periodic force along the track. Chosen.
  double min_pitch_m = 5e-4;
  /// [crests] A force is periodic only if the run passes this many of its crests. A vibration of an attached
  /// mass has so many periods in the longest run, and one in the longest segment.
  double crests_of_pitch = 3.0;
  /// [samples] Of a vibration of an attached mass, the fewest in a period. Two would do without noise.
  /// Chosen.
  double samples_of_vibration = 4.0;
  /// [m] Pitches up to this are always searched. Chosen.
  double min_longest_pitch_m = 0.002;
  /// [m] Half a track: the standard deviation of the centre of a spring about the mean position of the cart.
  /// For the track of a small cart, and scaled to other plants. Chosen.
  double spring_center_m = 0.5;
  /// [1] Bristles that bend over more than this share of the longest travel of one run before they slide act
  /// as a spring and are rejected. Bristles of 14 N/m with 5 N of friction had been found in place of a
  /// spring (canterbury data).
  double bristle_share_of_travel = 0.1;
  /// [N/m] The softest bristles. Softer ones act as a spring. For a small cart, and scaled to other plants.
  /// Chosen.
  double min_bristle_stiffness_n_per_m = 5.0;
  /// [N/m] The stiffest bristles. Stiffer ones are indistinguishable from a rigid contact. Bristles have at
  /// most the critical damping of the cart on the stiffest. Scaled as the softest. Chosen.
  double max_bristle_stiffness_n_per_m = 3e4;
  /// [1] The fewest counts that a counter loses of each count beyond its fastest rate. It loses one if it
  /// stays at that rate, and two if it takes a jump over two counts for none. Less may be friction: on
  /// aau-cart, 0.08 and 0.24 were found at two of six places, beyond speeds that exclude each other.
  double min_lost_share = 0.5;
  /// [s] The longest delay of the input. Chosen.
  double max_delay_s = 0.2;
  /// [sample periods] The shortest lag of the motor. Shorter ones are not visible.
  double min_lag_periods = 0.2;
  /// [s] The longest lag of the motor. Chosen.
  double max_lag_s = 0.5;
  /// [1] The shortest time constant of friction that warms up, as a share of the longest run. A shorter one
  /// is the start of the motion. Chosen.
  double min_warming_share = 0.05;
  /// [1] The longest. Beyond it the friction changes evenly during the whole run. Chosen.
  double max_warming_share = 2.0;
  /// [1] The smallest scale. If a smaller one is needed, something else is missing: a strong backlash had
  /// been explained by 0.3 times the mass.
  double min_scale = 0.3;
  /// [1] The largest scale. The same reason.
  double max_scale = 3.0;
};

/// What the runs can show at all.
struct ExcitationPolicy {
  /// [sensor steps] A signal that moves by no more contains no information. Chosen.
  double min_steps = 30.0;
  /// [m] The length of the pendulum when runs are sorted by the speed of the cart and of the pendulum's tip,
  /// to hold out a third of them. For a small cart, and scaled to other plants; it only weighs the two
  /// speeds. Chosen.
  double arm_m = 0.3;
  /// [s] Speeds are differences over this time. Over one sample they would be encoder steps. Chosen.
  double speed_window_s = 0.02;
};

struct SelectionPolicy {
  SignificancePolicy significance;
  AcceptancePolicy acceptance;
  CorrectionPolicy correction;
  PowerPolicy power;
  MotionPolicy motion;
  AdequacyPolicy adequacy;
  ResidualPolicy residual;
  LocationPolicy location;
  CurvePolicy curve;
  PriorPolicy prior;
  ExcitationPolicy excitation;
};

}  // namespace upright
