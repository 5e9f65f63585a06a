// The size of an effect in each run, with everything else common to all runs.
#pragma once

#include <cstddef>
#include <vector>

#include "parameter_equations.hpp"

namespace upright {

/// One parameter estimated for each run by itself.
struct SizeByRun {
  std::vector<std::size_t> runs;  ///< their numbers, in increasing order
  Eigen::VectorXd value;          ///< of the parameter, by run
  Eigen::MatrixXd covariance;     ///< of these values, including their scatter within the runs
  double freedom = 0.0;           ///< segments beyond one for each run: how well the scatter is known
};

/// Frees the parameter at `place` among the free ones in each run, beside all others in common, by one
/// Gauss-Newton step from `point`. `equations`: of all segments at this point. The covariance of the step is
/// multiplied by the dispersion of the segments' influences within the runs (at least 1).
SizeByRun size_by_run(const std::vector<ParameterEquations>& equations, const std::vector<Segment>& segments,
                      const FitPoint& point, const std::vector<FreeParameter>& free, std::size_t place);

}  // namespace upright
