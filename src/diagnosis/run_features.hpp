// What the size of an effect may depend on from run to run: what a record shows of its run, and the labels
// of its dataset file.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "upright/measurement/measurement.hpp"

namespace upright {

/// A feature of the runs on which the sizes depend.
struct RunDependence {
  std::string on;                  ///< in words: "the stroke", "the label day"
  std::vector<std::string> texts;  ///< of a label: what it is for each size; otherwise empty
  double chance = 1.0;             ///< probability of such a dependence by chance
};

/// The features of the runs on which `sizes` depend, in proportion or, for a label, by group; the surest
/// first. Several are found if the runs do not tell them apart. `runs[i]` is the run of size i. At least
/// four runs are needed. Any is found by chance with a probability of at most 5 % (Bonferroni). A label
/// counts if all runs have it.
std::vector<RunDependence> dependences_of(const Eigen::VectorXd& sizes,
                                          const std::vector<const Measurement*>& runs);

/// A number, or the hours since 1970 of a date: "2019-03-04", "2019-03-04 10:30", "2019-03-04T10:30:05Z".
/// Empty for anything else.
std::optional<double> label_number(std::string_view text);

}  // namespace upright
