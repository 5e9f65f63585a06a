// Whether the size of an effect differs from run to run, and with what the difference goes.
//
// Runs of one rig share one truth on a simulator. In a laboratory a constant force changes with the place on
// the rail, and friction with the day. The size of each effect is therefore estimated for each run, with
// everything else common to all runs (size_by_run.hpp). It differs if one run disagrees with all others by
// more than the scatter within the runs allows. The sizes are then taken as draws from one distribution
// (random effects; DerSimonian and Laird, Controlled Clinical Trials 7, 1986), and a new run has a size
// within its prediction interval (Higgins, Thompson and Spiegelhalter, JRSS A 172, 2009). The mean helps a
// run whose size is at least half of it. If that is not certain of a new run, the effect is not a property of
// the rig.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "run_features.hpp"
#include "search.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// The sizes of one effect.
struct RunDifference {
  std::size_t effect = 0;      ///< number in the registry
  std::vector<RunSize> sizes;  ///< by run, with 95 % intervals
  /// How certainly the run that disagrees most with the others does so [standard errors].
  double certainty = 0.0;
  /// By how much half of the mean size exceeds what a new run may be below it [standard errors].
  double certainty_of_help = 0.0;
  std::vector<RunDependence> depends;  ///< what the size may depend on, the surest first
};

/// Of each of these effects of `h`, a fit to all data, that the plant file lacks. Empty if there is one run.
std::vector<RunDifference> run_differences(const Search& search, const Hypothesis& h,
                                           const std::vector<std::size_t>& effects);

/// Whether the sizes differ so that the effect need not help on a further run.
bool is_of_single_runs(const RunDifference& difference, const SignificancePolicy& policy);

/// The one of these that is so and is the most certain; else null.
const RunDifference* most_certain_of_single_runs(const std::vector<RunDifference>& differences,
                                                 const SignificancePolicy& policy);

/// A sentence for the listing of effects that help here only.
std::string sentence_on(const RunDifference& difference, const std::vector<Measurement>& runs);

}  // namespace upright
