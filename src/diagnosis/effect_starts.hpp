// The starts of the fit of an effect, from the residual of an earlier fit of the same data.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "candidates.hpp"

namespace upright {

/// Remembers the latest starts of periodic effects, which take as long as a fit: each round asks for them
/// twice.
class EffectStarts {
 public:
  /// Both must outlive it.
  EffectStarts(const SelectionPolicy& policy, const SearchBudget& budget)
      : policy_(policy), budget_(budget) {}

  /// Of an effect beside the model at `point`. A periodic one starts from the pitches that the residual has
  /// most of.
  std::vector<std::vector<double>> of(std::size_t effect, const DataRange& range, const FitData& data,
                                      const FitPoint& point);

 private:
  const SelectionPolicy& policy_;
  const SearchBudget& budget_;
  std::optional<FitPoint> point_;  ///< of the latest
  std::vector<PlaceForce> residual_;
  std::map<std::size_t, std::vector<std::vector<double>>> periodic_;  ///< by the number of the effect
};

}  // namespace upright
