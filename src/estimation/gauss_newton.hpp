// Gauss-Newton with damping for the parameters and the initial states of all segments, with the noise held.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "fit.hpp"
#include "linearisation.hpp"

namespace upright {

/// What is believed of the free parameters beforehand: a Gaussian.
class Prior {
 public:
  Prior(const std::vector<FreeParameter>& free, const std::optional<GaussianPrior>& joint);

  const Eigen::MatrixXd& information() const { return information_; }
  /// How far the parameters of a plant are from its mean.
  Eigen::VectorXd deviation(const Plant& plant) const;
  double objective(const Plant& plant) const;

 private:
  const std::vector<FreeParameter>& free_;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd information_;
};

/// A fit on its way. The segments are linearised at the present point after evaluate() and descend().
class GaussNewton {
 public:
  /// Keeps references to the data, the free parameters and the options.
  GaussNewton(const FitData& data, const FitPoint& start, const std::vector<FreeParameter>& free,
              const FitOptions& options);

  struct Step {
    FitPoint point;
    std::vector<PlantState<double>> starts_at_held_speed;  ///< an alternative for each segment
    double predicted_reduction = 0.0;                      ///< of the objective, were the residuals linear
    bool cut_short = false;                                ///< at a bound, or for its length
  };

  /// Linearises at the present point; its objective.
  double evaluate();
  /// Its objective, where the equations of all segments are known.
  double begin_with(const std::vector<NormalEquations>& equations);
  /// Linearises if only the equations are known.
  void require_steps();
  /// Descends from an evaluated point of this objective. A step counts only if the whole objective falls,
  /// weights and log variances included.
  void descend(double& objective);
  /// The information on the parameters without damping, the scatter of their scores over segments as if there
  /// were more of them (small-sample correction), and the sum of the scores. Priors are in all but the
  /// scatter.
  struct Information {
    Eigen::MatrixXd total, scatter;
    Eigen::VectorXd score;
  };
  Information information() const;
  /// The next step, were it hardly damped.
  Step further_step() const { return step(negligible_damping); }
  /// Whether the bound of the data leaves more to do.
  bool is_within_bound() const {
    return data_.bound == nullptr || !data_.bound->is_reached_with(work_samples_);
  }

  FitPoint& point() { return point_; }
  const FitPoint& point() const { return point_; }
  const Prior& prior() const { return prior_; }
  const std::vector<LinearisedSegment>& linearised() const { return linearised_; }
  bool converged() const { return converged_; }
  double work_samples() const { return work_samples_; }

 private:
  /// Of a first step, if it promises more than the noise of all samples is.
  static constexpr double far_damping = 1e-4;
  /// Of a first step near the optimum. Damping goes by what the data say of each parameter. Where two
  /// parameters are one force, only the belief tells them apart: next to nothing beside that, and a step
  /// along the two must not be damped.
  static constexpr double negligible_damping = 1e-12;
  static constexpr double first_damping = 3e-3;   ///< after an undamped step that failed
  static constexpr double damping_growth = 30.0;  ///< after a damped step that failed
  static constexpr double damping_decay = 0.1;    ///< after a step that was taken

  struct ReducedEquations;

  void linearise(std::size_t s);
  void count_work();
  double evaluate_step(const std::vector<PlantState<double>>& starts_at_held_speed,
                       double predicted_reduction);
  double rise_of(std::size_t s) const;
  void take_start_if_better(std::size_t s, const PlantState<double>& alternative);
  double objective_of_normals() const;
  double sample_count() const;
  double try_steps(double objective, double min_fall, double& damping);
  ReducedEquations eliminate_initial_states(double damping) const;
  Step step(double damping) const;
  void move_parameters(Eigen::VectorXd& delta, Step& result) const;
  void move_initial_states(const ReducedEquations& reduced, const Eigen::VectorXd& delta, Step& result) const;
  void move_start_positions(const Eigen::VectorXd& delta, Step& result) const;
  Eigen::VectorXd bounded_step(const ReducedEquations& reduced, double damping, bool& cut_short) const;
  Eigen::VectorXd solve_for(const std::vector<Eigen::Index>& moving, const Eigen::VectorXd& delta,
                            const ReducedEquations& reduced, double damping) const;

  const FitData& data_;
  const std::vector<FreeParameter>& free_;
  const FitOptions& options_;
  FitPoint point_;
  Prior prior_;
  std::vector<LinearisedSegment> linearised_, former_;
  std::vector<std::size_t> order_;  ///< in which segments are looked at; no result depends on it
  bool converged_ = false;
  double work_samples_ = 0.0;
};

}  // namespace upright
