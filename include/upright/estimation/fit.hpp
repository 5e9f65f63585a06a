// Multiple-shooting fit of a plant to measured runs.
//
// Every run is cut into segments. Each is followed from its own initial state with the recorded voltages by
// an extended Kalman filter through the event engine, whose noise is the encoders' quantisation, timing
// jitter, and a white force and torque that stand for what no model explains; without force and torque it is
// a plain simulation. The sum of squared innovations and log variances is minus twice the log likelihood.
// Parameters and initial states follow by Gauss-Newton with exact derivatives (dual numbers through the event
// engine); the initial states are eliminated (Schur complement), and the noise is estimated by maximum
// likelihood in turn.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "upright/estimation/linear_step.hpp"
#include "upright/estimation/noise.hpp"
#include "upright/estimation/segments.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// A parameter of an effect that the fit may move, and what is believed of it beforehand.
struct FreeParameter {
  std::size_t effect = 0;
  std::size_t index = 0;
  double low = 0.0;
  double high = 0.0;
  double scale = 1.0;  ///< its order of magnitude
  double prior_mean = 0.0;
  double prior_sigma = 0.0;  ///< 0: nothing is believed
};

/// A state at the start of each segment, from the data alone.
std::vector<PlantState<double>> guess_starts(const std::vector<Measurement>& runs,
                                             const std::vector<Segment>& segments, const Plant& plant);

/// Moves starts with the sensors, where one plant shows the same motion otherwise than another.
void follow_sensors(std::vector<PlantState<double>>& starts, const Plant& from, const Plant& to);

struct FitPoint {
  Plant plant;
  std::vector<PlantState<double>> starts;  ///< one per segment
  Noise noise;
};

struct FitResult {
  FitPoint point;
  double objective = 0.0;  ///< minus twice the log of likelihood and priors
  /// Of the objective in a further step, were residuals linear; nothing where a step must be cut short.
  std::optional<double> promised_fall;
  double bounded_fall = 0.0;               ///< the same of a step that is cut short where it must be
  std::vector<double> segment_objective;   ///< the likelihood part, by segment
  std::vector<double> block_objective;     ///< the same by blocks of a quarter of a second, in order
  std::vector<double> segment_chi_square;  ///< sum of squared whitened residuals, by segment
  std::vector<double> segment_samples;     ///< how many numbers that sums, by their weight
  Eigen::MatrixXd covariance;              ///< of the free parameters, robust to noise that is not white
  Eigen::MatrixXd information;             ///< of the free parameters, initial states eliminated
  bool converged = false;
  double work_samples = 0.0;  ///< how many samples were followed, each as often as it was
};

/// What is believed of all free parameters together: a Gaussian, in their order.
struct Belief {
  Eigen::VectorXd mean;
  Eigen::MatrixXd information;
};

struct FitOptions {
  int most_iterations = 12;
  int noise_rounds = 6;           ///< how often the noise is estimated anew at most; 0: as given
  std::optional<Noise> or_noise;  ///< another place from which to search for the noise, if it is the better
  bool noise_last = false;        ///< with no rounds: estimate the noise once, roughly, after the descent
  std::optional<Belief> belief;   ///< in the place of what each free parameter says of itself
  double tolerance = 1e-4;        ///< relative fall of the objective per sample at which to stop
};

/// Fits. A fit that fails returns an infinite objective. Throws only Interrupted (parallel.hpp), and
/// BoundReached where the bound of the data was reached before it began; one that reaches it on its way ends
/// where it is.
FitResult fit(const FitData& data, const FitPoint& start, const std::vector<FreeParameter>& free,
              const FitOptions& options = {});

/// Fits the initial states alone, with plant and noise held. Throws as `fit` does.
FitResult fit_initial_states(const FitData& data, const FitPoint& start,
                             int most_iterations = FitOptions{}.most_iterations);

/// The point with its initial states fitted, for a first fit: what guessed ones leave is not noise. As it
/// was where they cannot be.
FitPoint with_fitted_initial_states(const FitData& data, FitPoint point);

/// Linearised steps of every segment at a point, for residual analysis.
std::vector<std::vector<LinearStep>> linearise(const FitData& data, const FitPoint& point);

/// Root mean square over all samples of the whitened residuals [noise standard deviations].
double whitened_rms(const FitResult& result);

}  // namespace upright
