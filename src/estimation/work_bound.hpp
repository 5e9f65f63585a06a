// A bound on the work of a search. The unit is one sample processed once with its derivatives. A count
// does not depend on the machine, its load or its number of cores, so that a bounded search gives the
// same result everywhere; a time limit would not.
#pragma once

#include <exception>

namespace upright {

/// A search ended because its bound was reached.
class BoundReached : public std::exception {
 public:
  /// The sentence for the user.
  const char* what() const noexcept override { return "the bound of the search is reached"; }
};

/// Counted by fits whose data have a pointer to it. Not thread-safe.
class WorkBound {
 public:
  /// The bound, in samples processed.
  explicit WorkBound(double max_samples) : left_samples_(max_samples) {}

  /// So many samples were processed.
  void count(double samples) {
    left_samples_ -= samples;
    counted_samples_ += samples;
  }
  void grant(double samples) { left_samples_ = samples; }  ///< so many samples are left from now on
  /// Whether this much additional work would reach the bound.
  bool is_reached_with(double samples) const { return samples >= left_samples_; }
  double counted_samples() const { return counted_samples_; }  ///< processed until now
  /// Throws BoundReached where the bound is reached.
  void check() const {
    if (is_reached_with(0.0)) throw BoundReached();
  }

 private:
  double left_samples_, counted_samples_ = 0.0;
};

}  // namespace upright
