// The search on thinned data that goes before the search on all.
#pragma once

#include <memory>
#include <vector>

#include "stepwise_selection.hpp"

namespace upright {

/// Thinned runs, and a selection that works on them.
class Exploration {
 public:
  /// `search` and `options` must outlive it.
  Exploration(const Search& search, const DiagnosisOptions& options);

  /// Null where thinning saves too little.
  static std::unique_ptr<Exploration> of(const Search& search, const DiagnosisOptions& options);

  StepwiseSelection& selection() { return selection_; }
  /// How many times as many samples the complete data have.
  double sample_ratio() const { return sample_ratio_; }

 private:
  std::vector<Measurement> runs_;
  FitData train_, held_;
  double sample_ratio_;
  Diagnosis record_;
  Search search_;
  StepwiseSelection selection_;
};

}  // namespace upright
