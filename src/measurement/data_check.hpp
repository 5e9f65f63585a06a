// Mistakes in the description of measured data: sign, zero, unit, swapped, folded and late columns, and time
// stamps that scatter. They are detected before the search, because the search would explain them by physics:
// a wrong sign of the voltage by a saturation of 0.01 V, an angle that is zero when hanging by a pendulum of
// three times the length.
//
// The equations of the plant are fitted to the record over short windows, with wide ranges for mass, friction
// and delay:
//   k V(t - d) = (M + m) x'' + m l (sin theta)'' + b x' + Fc sign(x') + F0     (cart)
//   theta''    = (g sin theta - cos theta x'') / L - D theta' - E sign(theta')  (pendulum)
// A mistake is reported only if the data contradict the equations strongly and fit them once it is corrected.
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
  std::vector<std::string> lines;    ///< lines for the columns of a dataset file that correct it
  std::vector<std::string> or_else;  ///< other possible mistakes, with their lines
};

/// The mistakes that are certain. Empty if there are none or the data are too few.
std::vector<DataMistake> find_mistakes(const std::vector<Measurement>& runs, const Plant& plant);

/// Throws ConfigError with the mistakes and the lines that correct them.
void refuse_mistakes(const std::vector<Measurement>& runs, const Plant& plant);

}  // namespace upright
