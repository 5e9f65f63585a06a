// A sweep over the ranks of mpirun: the first rank hands out groups as ranks become free and writes the
// results, which are the same bytes as in one process. Without MPI at configure time there is one rank.
#pragma once

#include <memory>

#include "sweep.hpp"

namespace upright {

/// MPI from construction to destruction, when mpirun started this process; one rank otherwise. One per
/// process.
class MpiExecutor {
 public:
  MpiExecutor();
  ~MpiExecutor();
  MpiExecutor(const MpiExecutor&) = delete;
  MpiExecutor& operator=(const MpiExecutor&) = delete;

  bool first() const { return rank_ == 0; }
  int count() const { return count_; }

  /// For the first rank: a executor of all ranks with `threads` threads each (0: one each, or every processor
  /// where there is one rank). Destroy it before this object: that lets the others go.
  std::unique_ptr<SweepExecutor> make_executor(const SweepConfig& config, unsigned threads) const;
  /// For the other ranks: computes what the first one hands out until that lets go.
  void serve(const SweepConfig& config, unsigned threads) const;

 private:
  int rank_ = 0;
  int count_ = 1;
};

}  // namespace upright
