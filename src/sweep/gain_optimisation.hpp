// Gains, and the tuning number of the estimator, with the smallest mean cost over the drawn plants of a
// sweep.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sweep.hpp"
#include "upright/base/progress.hpp"

namespace upright {

/// What a run costs: a fall, or the amplitudes and the voltage over the last third of a run that does not
/// fall.
struct RunCost {
  double fall = 1.0;           ///< of a run that falls
  double cart_per_m = 10.0;    ///< of half the peak-to-peak motion of the cart [1/m]
  double angle_per_rad = 1.0;  ///< of half the peak-to-peak motion of the pendulum [1/rad]
  double per_v = 0.0;          ///< of the root mean square of the commanded voltage, of sampled loops [1/V]
};

/// The mean over starts, delays and plants.
struct MeanCost {
  double cost = 0.0;
  double share_falls = 0.0;
  double cart_amplitude_m = 0.0, theta_amplitude_rad = 0.0;  ///< of the runs that do not fall; NaN: all do
  double voltage_rms_v = 0.0;  ///< of them, the mean of the root mean squares; NaN: also of continuous loops
  std::vector<double> of_plant;  ///< the cost by plant
};
/// With the gains, plants and seed of `config`. Uses all processors; the result does not depend on them.
MeanCost mean_cost(const SweepConfig& config, const RunCost& cost);

/// A number of the gain file before and after.
struct TunedNumber {
  std::string name;
  double before = 0.0, after = 0.0;
};

struct OptimisationRequest {
  RunCost cost;
  int evaluations = 200;  ///< of the mean cost, at most
  unsigned seed = 1;      ///< of the search
  ProgressCallback progress;
};

struct Optimisation {
  std::vector<TunedNumber> numbers;
  ControlConfig control;                            ///< the gain file of the sweep with the numbers after
  MeanCost before, after;                           ///< over the plants of the search
  std::uint32_t fresh_seed = 0, fresh_samples = 0;  ///< of plants that the search did not see
  MeanCost fresh_before, fresh_after;
  double gained = 0.0,
         gained_error = 0.0;  ///< of the fresh plants: mean fall of the cost, its standard error
  std::vector<LinearMargin> margins_before, margins_after;

  /// Whether the fresh plants show it, with 97.5 percent confidence.
  bool is_better() const;
};

/// Searches from the gain file of the sweep. Throws ConfigError where the sweep has no `uncertainty`, or
/// where the voltage of a continuous loop is to cost.
Optimisation optimise_gains(const SweepConfig& config, const OptimisationRequest& request);

}  // namespace upright
