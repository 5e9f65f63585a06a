// One run of a rig that is not the model's: the CVODE reference engine with true events follows the true
// plant, encoders are quantised, reading times jitter, an unmodelled force may act, and what no effect of the
// registry says (backlash, friction that warms up, gusts) may be there.
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
enum class Unknown { none, backlash, warming_friction, gusts };

std::string_view name_of(Unknown unknown);

/// The rig as it is.
struct Rig {
  Plant plant;
  Unknown unknown = Unknown::none;
  double backlash_m = 0.0;       ///< play between cart and encoder
  double warming_force_n = 0.0;  ///< Coulomb friction above its final level when a run starts
  double warming_time_s = 5.0;   ///< time constant with which it goes
  double gust_force_n = 0.0;     ///< typical peak
  double disturbance_n = 0.0;    ///< rms of a force of 10 Hz bandwidth (Ornstein-Uhlenbeck)
  double jitter_s = 0.0;         ///< standard deviation of the time at which encoders are read
  bool actual_times = false;     ///< the record holds the times of reading, not k / rate
  double cart_step_m = 2.27485e-5;
  double theta_step_rad = 1.5339807878856412e-3;  ///< 4096 counts a turn
};

enum class Experiment { balance, multisine, square, constant, coast, locked_swing };

std::string_view name_of(Experiment experiment);

/// What is done in a run.
struct Plan {
  Experiment experiment = Experiment::multisine;
  double rate_hz = 500.0;
  double duration_s = 8.0;
  double amplitude_v = 2.0;
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
