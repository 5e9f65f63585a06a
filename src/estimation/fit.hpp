// Multiple-shooting fit of a plant to measured runs.
//
// Each run is cut into segments. For each segment an extended Kalman filter with the event engine
// processes the recorded voltages and measurements from its own initial state. Its noise: the encoders'
// quantisation, timing jitter, and a white force and torque for unmodelled disturbances; without these it
// is a free-run simulation. Minus twice the log likelihood is the sum of squared normalised innovations
// and of the log variances. Gauss-Newton with exact derivatives (dual numbers) estimates parameters and
// initial states; the latter are eliminated (Schur complement). The noise is estimated by maximum
// likelihood in alternation.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "linear_step.hpp"
#include "segments.hpp"
#include "upright/estimation/noise.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// A parameter of an effect that the fit may change, with its prior.
struct FreeParameter {
  std::size_t effect = 0;    ///< number in the registry
  std::size_t index = 0;     ///< which of its parameters
  double low = 0.0;          ///< lower bound
  double high = 0.0;         ///< upper bound
  double scale = 1.0;        ///< order of magnitude
  double prior_mean = 0.0;   ///< expected value before the data
  double prior_sigma = 0.0;  ///< standard deviation; 0: no prior
};

/// Estimates the state at the start of each segment from the data alone (local parabolas).
std::vector<PlantState<double>> estimate_initial_states(const std::vector<Measurement>& runs,
                                                        const std::vector<Segment>& segments,
                                                        const Plant& plant);

/// Converts initial states to a plant whose sensors show the same motion differently.
void convert_initial_states(std::vector<PlantState<double>>& starts, const Plant& from, const Plant& to);

/// What a fit starts from, and ends with.
struct FitPoint {
  Plant plant;                             ///< with the values of the free parameters
  std::vector<PlantState<double>> starts;  ///< one per segment
  Noise noise;                             ///< of the sensors and of the process
};

struct NormalEquations;  // linearisation.hpp

/// The result of a fit.
struct FitResult {
  FitPoint point;          ///< where it ended
  double objective = 0.0;  ///< minus twice the log of likelihood and priors
  /// Predicted reduction by a further step, residuals being linear; absent where bounds cut it short.
  std::optional<double> predicted_reduction;
  double bounded_reduction = 0.0;          ///< the same for a step that is cut short at bounds
  std::vector<double> segment_objective;   ///< likelihood part, by segment
  std::vector<double> block_objective;     ///< the same by blocks of a quarter of a second, in order
  std::vector<double> segment_chi_square;  ///< sum of squared whitened residuals, by segment
  std::vector<double> segment_samples;     ///< number of residuals in that sum, weighted
  Eigen::MatrixXd covariance;  ///< of the free parameters, robust to coloured noise (sandwich estimator)
  /// How far from its bound each free parameter that is there may be (95 %); zero for the others.
  Eigen::VectorXd bound_reach;
  Eigen::MatrixXd information;  ///< of the free parameters, initial states eliminated
  /// Variance of the scores of segments relative to what the likelihood says: 1 if the noise is as modelled.
  double dispersion = 1.0;
  bool converged = false;     ///< false: the iterations were used up
  double work_samples = 0.0;  ///< number of samples processed, counting repetitions
  /// Of each segment at `point`, if the options ask for them.
  std::shared_ptr<const std::vector<NormalEquations>> equations;
};

/// A joint Gaussian prior of all free parameters, in their order.
struct GaussianPrior {
  Eigen::VectorXd mean;         ///< of the parameters, in the order of the free ones
  Eigen::MatrixXd information;  ///< inverse of their covariance, square
};

/// How a fit proceeds.
struct FitOptions {
  int max_iterations = 12;                 ///< of Gauss-Newton
  int noise_rounds = 6;                    ///< upper bound of noise estimations; 0: the noise is fixed
  std::optional<Noise> alternative_noise;  ///< second starting point of the noise search, used where it gives
                                           ///< the better result
  /// Without rounds: one coarse noise estimation after the descent, if the objective is below this.
  double noise_at_end_below = -std::numeric_limits<double>::infinity();
  bool coloured_noise = false;  ///< estimate the coloured part of the noise too; else it stays as it is
  std::optional<GaussianPrior> joint_prior;  ///< replaces the priors of the free parameters
  double tolerance = 1e-4;                   ///< stop at this relative reduction of the objective per sample
  bool keep_equations = false;               ///< for a fit that continues from the result
};

/// Of a fit whose noise stays. Without steps it says how the data depend on the parameters.
FitOptions steps_with_fixed_noise(int steps);

/// The most derivatives that a fit takes: with respect to the states of the plant and the free parameters.
inline constexpr std::size_t max_derivatives = 32;
/// The most parameters that a fit of this plant can free.
std::size_t max_free_parameters(const Plant& plant);

/// Fits a plant. The objective of a failed fit is infinite; with more free parameters than that it
/// fails. Throws only Interrupted (parallel.hpp), and BoundReached if the bound of the data was reached
/// beforehand. A fit that reaches the bound returns its present point.
FitResult fit(const FitData& data, const FitPoint& start, const std::vector<FreeParameter>& free,
              const FitOptions& options = {});

/// The same from where another fit of these data and free parameters ended, which kept its equations: the
/// data are not linearised there again.
FitResult continue_fit(const FitData& data, const FitResult& from, const std::vector<FreeParameter>& free,
                       const FitOptions& options = {});

/// The objective after one step within the ranges of the parameters, were residuals linear. A step that is
/// cut short may promise to be worse: then the present one.
double objective_after_step(const FitResult& seen);
/// The same of a point.
double objective_after_step(const FitData& data, const FitPoint& point,
                            const std::vector<FreeParameter>& free);

/// Fits the initial states only, with fixed plant and noise. Throws as `fit` does.
FitResult fit_initial_states(const FitData& data, const FitPoint& start,
                             int max_iterations = FitOptions{}.max_iterations);

/// The point with fitted initial states, for a first fit, since errors of estimated ones are not noise.
/// Unchanged where the fit fails.
FitPoint with_fitted_initial_states(const FitData& data, FitPoint point);

/// The linearised steps of all segments at a point, for residual analysis.
std::vector<std::vector<LinearStep>> linearise(const FitData& data, const FitPoint& point);

/// Root mean square of the whitened residuals over all samples [noise standard deviations].
double whitened_rms(const FitResult& result);

/// Minus twice the log likelihood of a fit, without its priors.
double minus_log_likelihood(const FitResult& result);

}  // namespace upright
