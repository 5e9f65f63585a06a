// Mistakes in the description of measured data: sign, zero, unit, swapped, folded and late columns, time
// stamps that scatter. Found before any search,
// for afterwards they end as physics: a flipped voltage as a saturation of 0.01 V, an angle with its zero
// hanging as a pendulum of three times the length.
//
// The plant's own equations are fitted to the record over short windows, with generous freedom for mass,
// friction and delay:
//   k V(t - d) = (M + m) x'' + m l (sin theta)'' + b x' + Fc sign(x') + F0     (cart)
//   theta''    = (g sin theta - cos theta x'') / L - D theta' - E sign(theta')  (pendulum)
// Only where the data as they are contradict them grossly, and a mistake undone makes them fit, it is named.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

struct DataMistake {
  std::size_t run = 0;
  std::string cause;                 ///< "theta_rad is zero where the pendulum hangs"
  std::vector<std::string> lines;    ///< of the dataset file's columns, that undo it
  std::vector<std::string> or_else;  ///< what it may be instead, with its lines
};

/// What is certain to be wrong with the runs; empty where nothing is, and where the data are too few to tell.
std::vector<DataMistake> find_mistakes(const std::vector<Measurement>& runs, const Plant& plant);

/// Throws ConfigError for the mistakes, with the lines that undo them.
void refuse_mistakes(const std::vector<Measurement>& runs, const Plant& plant);

}  // namespace upright
