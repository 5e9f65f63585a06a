// The last fits of a diagnosis, once the search has found its effects: which numbers of the plant file are
// corrected beside them, and what the model says in the end.
#pragma once

#include <optional>
#include <set>
#include <vector>

#include "search.hpp"
#include "stepwise_selection.hpp"
#include "withdrawal.hpp"

namespace upright {

class FinalFits {
 public:
  /// `search`, `selection`, `options` and `all_samples` must outlive it. `all_samples`: of the runs, where
  /// the search has thinned ones; else null.
  FinalFits(Search& search, const StepwiseSelection& selection, const std::vector<Measurement>* all_samples,
            const DiagnosisOptions& options);

  /// Fits what the selection found, with the corrections that are really there but for the `withdrawn` ones.
  void settle(const std::set<std::size_t>& withdrawn);
  /// Fits `known()` to all samples.
  void fit_all_samples();
  /// An effect that this fit leaves too uncertain: its size, its phase or its pitch.
  std::optional<Withdrawal> uncertain_effect() const;

  /// Fitted to the training runs, judged on the others.
  const Hypothesis& judged() const { return judged_; }
  /// The same effects fitted to all runs.
  const Hypothesis& known() const { return known_; }
  /// The same fitted to all samples: what the model says in the end.
  const Hypothesis& reported() const { return reported_; }
  /// What was found, and the corrections.
  std::vector<std::size_t> effects() const;
  const std::vector<std::size_t>& corrections() const { return corrections_; }

 private:
  /// The last fits, of training runs and of all. A correction that these leave uncertain is none: it goes.
  void fit_last(std::vector<std::size_t>& corrections);
  /// Of the effects that do nothing in that fit, or whose 95 % interval includes nothing, the least certain
  /// one.
  std::optional<std::size_t> effect_with_open_size() const;
  /// An effect whose phase that fit leaves open.
  std::optional<std::size_t> effect_with_open_phase() const;
  /// Not of the plant file.
  std::optional<std::size_t> effect_with_open_pitch() const;
  /// A coefficient of the plant file that moved within what is believed of it.
  bool keeps_prior(const Hypothesis& h, std::size_t j) const;
  /// Corrections in the order of how much each closes: of sensors first, then of the plant's numbers, which
  /// are always a little off.
  void order_corrections(const std::vector<std::size_t>& corrections);

  Search& search_;
  const StepwiseSelection& selection_;
  const std::vector<Measurement>* const all_samples_;
  const DiagnosisOptions& options_;
  const SelectionPolicy& policy_;
  std::vector<std::size_t> corrections_;
  Hypothesis judged_, known_, reported_;
};

}  // namespace upright
