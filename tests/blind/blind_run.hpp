// One run of a rig that is not the model's: the CVODE reference engine with true events follows the true
// plant, sensors are quantised or noisy, reading times jitter, unmodelled forces and torques may act, and
// what no effect of the registry says (play of an encoder, gusts, ...) may be there.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright::blind {

/// What no effect of the registry describes.
enum class Unknown {
  none,
  encoder_play,
  gusts,
  rough_track,      ///< a random force that belongs to the place
  velocity_ripple,  ///< a force that ripples with the velocity
  force_drift,      ///< a force that grows along the run, from -size to +size
};

std::string_view name_of(Unknown unknown);

/// Gauss-Markov force and torque: standard deviation and correlation time.
struct ColouredDisturbance {
  double force_n = 0.0, force_time_s = 0.1;
  double torque_nm = 0.0, torque_time_s = 0.1;
  /// The standard deviation of the force grows with speed: sqrt(1 + (v / speed)^2) times; 0: it does not.
  double speed_mps = 0.0;
};

/// The rig as it is.
struct Rig {
  Plant plant;
  Unknown unknown = Unknown::none;
  double play_m = 0.0;        ///< play between cart and encoder
  double gust_force_n = 0.0;  ///< typical peak
  /// rough_track: standard deviation [N]; velocity_ripple and force_drift: amplitude [N].
  double unknown_size = 0.0;
  /// rough_track: correlation length [m]; velocity_ripple: velocity of a period [m/s].
  double unknown_period = 1.0;
  double disturbance_n = 0.0;  ///< rms of a force of 10 Hz bandwidth (Ornstein-Uhlenbeck)
  double jitter_s = 0.0;       ///< standard deviation of the time at which encoders are read
  bool actual_times = false;   ///< the record holds the times of reading, not k / rate
  ColouredDisturbance coloured = {};
  double rough_n = 0.0;  ///< standard deviation of a force that belongs to the place
  double rough_length_m = 0.01;
  std::uint64_t track_seed = 1;
  double cart_step_m = 2.27485e-5;                   ///< 0: not quantised
  double theta_step_rad = 1.5339807878856412e-3;     ///< 4096 counts a turn
  double cart_noise_m = 0.0, theta_noise_rad = 0.0;  ///< standard deviation of the white part
  double noise_colour = 0.0;   ///< standard deviation of the coloured part, relative to it
  double noise_time_s = 0.02;  ///< its correlation time
};

enum class Experiment { balance, multisine, square, constant, coast, locked_swing };

std::string_view name_of(Experiment experiment);

/// What is done in a run.
struct Plan {
  Experiment experiment = Experiment::multisine;
  double rate_hz = 500.0;
  double duration_s = 8.0;
  double amplitude_v = 2.0;
  double reach = 1.0;              ///< travel of balance and constant, relative to the cart of the paper
  double centring_v_per_m = 8.0;   ///< open-loop runs are held on the track by this
  std::array<double, 4> gains{};   ///< balance
  double loop_delay_s = 0.0;       ///< balance
  std::optional<double> let_go_s;  ///< balance: the amplifier goes to 0 V there, the pendulum falls
  double swing_rad = 0.2;          ///< starting angle from hanging, or from upright when balancing
  std::vector<std::pair<double, double>> gaps_s;  ///< stretches of which no row is recorded: from, length
  std::uint64_t seed = 1;                         ///< of phases, set-points, disturbance and jitter
};

/// Follows a plan. Throws Error where the reference engine gives up.
Measurement measure(const Rig& rig, const Plan& plan, const std::string& name);

}  // namespace upright::blind
