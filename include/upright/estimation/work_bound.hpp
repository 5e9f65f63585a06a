// How much a search may do. Work is counted in samples: following one sample of the data once, with its
// derivatives, is one. A count does not depend on the machine, its load or its number of cores, so a search
// that its bound ends gives the same answer everywhere; seconds would not.
#pragma once

#include <exception>

namespace upright {

/// A search was given up because its bound is reached.
class BoundReached : public std::exception {
 public:
  const char* what() const noexcept override { return "the bound of the search is reached"; }
};

/// Counted by fits on data that carry a pointer to it. Not for several threads at once.
class WorkBound {
 public:
  explicit WorkBound(double most_samples) : left_samples_(most_samples) {}

  void count(double samples) { left_samples_ -= samples; }
  void grant(double samples) { left_samples_ = samples; }
  /// Whether that much more would reach it.
  bool is_reached_with(double samples) const { return samples >= left_samples_; }
  /// Throws BoundReached where nothing is left.
  void check() const {
    if (is_reached_with(0.0)) throw BoundReached();
  }

 private:
  double left_samples_;
};

}  // namespace upright
