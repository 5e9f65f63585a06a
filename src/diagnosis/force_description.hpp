// The last resort where no named effect suffices: the force on the cart that is missing, as a curve over the
// quantity that shows it best (effect `force_table`). It describes the force and does not explain it.
#pragma once

#include <optional>
#include <string>

#include "search.hpp"

namespace upright {

/// A model with the curve.
struct ForceDescription {
  Hypothesis judged;            ///< fitted to the training data, held-out data followed by simulation
  Hypothesis known;             ///< fitted to all data
  double held_out_error = 0.0;  ///< of an open-loop simulation of held-out data [sensor noise]
  std::string where;            ///< over what the force lies, and how clear that is
  bool is_of_velocity = false;  ///< else of the position, as the force of a rough track is
  double held_evidence = 0.0;   ///< what a curve of many nodes saves on held-out data, linearised

  /// Whether held-out data show the force too. Of the position, their simulation must say so, since every
  /// track is a little rough. `lower`: by which factor the curve lowers the error of that simulation.
  bool shows_on_held_out(double lower, const SelectionPolicy& policy) const;
  /// Whether the fits moved the parameters of this effect too.
  bool moved(std::size_t effect) const;
  /// What is left without the curve.
  std::string left_sentence() const;
  /// The curve as an effect of the answer, with these gaps.
  FoundEffect as_effect(double gap_before, double gap_after) const;
};

/// Empty if the cart does not move, if no data are held out, if the plant file has a table already, if the
/// training data show no such force beyond what known effects have, or if held-out data contradict it.
/// `judged`: a fit to the training data, `known`: to all data. `with_trend`: a curve over the position may
/// have a trend, because the search gave a force of this kind up. Whether the curve helps on held-out data is
/// for the caller to judge. Throws Interrupted and BoundReached.
std::optional<ForceDescription> describe_force(const Search& search, const Hypothesis& judged,
                                               const Hypothesis& known, bool with_trend);

}  // namespace upright
