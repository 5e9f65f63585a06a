// Sweeps with MPI: the first rank distributes tasks to idle ranks and writes the results, which are
// byte-identical to those of one process. Without MPI at configure time there is one rank.
#pragma once

#include <memory>

#include "sweep.hpp"

namespace upright {

/// Initialises MPI if mpirun started this process, and finalises it at destruction; otherwise one rank.
/// One object per process.
class MpiExecutor {
 public:
  MpiExecutor();
  ~MpiExecutor();
  MpiExecutor(const MpiExecutor&) = delete;
  MpiExecutor& operator=(const MpiExecutor&) = delete;

  bool first() const { return rank_ == 0; }
  int count() const { return count_; }

  /// The lowest rank that failed; count() if none did. Waits until each rank has called it.
  int first_failed(bool failed) const;

  /// For the first rank: an executor for all ranks with `threads` threads each (0: one each, or every
  /// processor with a single rank). It must be destroyed before this object: this ends the other ranks.
  std::unique_ptr<SweepExecutor> make_executor(const SweepConfig& config, unsigned threads) const;
  /// For the other ranks: computes tasks from the first rank until that ends them.
  void serve(const SweepConfig& config, unsigned threads) const;

 private:
  int rank_ = 0;
  int count_ = 1;
};

}  // namespace upright
