// The part of a linear plant that its voltage can move, in the coordinates of states that are fed back.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "model/linear_plant.hpp"

namespace upright {

/// A state that is not free: it follows the kept ones, but for a part that the voltage cannot move.
struct EliminatedState {
  std::string state;
  std::complex<double> eigenvalue;  ///< of the part that cannot be moved [1/s]
  std::string explanation;
};

struct ControllablePart {
  std::vector<std::string> states;  ///< kept, r of n
  Eigen::MatrixXd a;                ///< r x r
  Eigen::VectorXd b;                ///< r
  Eigen::MatrixXd follow;           ///< n x r: all states from the kept ones, on the controllable subspace
  std::vector<EliminatedState> eliminated;
};

/// Staircase by a Krylov sequence of (A, b); keeps the first states that span the controllable subspace, so
/// the fed-back ones before the others. Throws ConfigError, naming and printing the matrix, when a fed-back
/// state cannot be moved or the part left out would grow.
ControllablePart controllable_part(const LinearPlant& linear);

}  // namespace upright
