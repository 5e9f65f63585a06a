// Where lanes take their runs from. A lane that has ended a run asks for the next, so that results can decide
// which runs follow.
#pragma once

#include <cstddef>

#include "loop_run.hpp"

namespace upright {

/// One run, with the number by which its source knows it.
struct LoopRun {
  std::size_t number = 0;
  LoopCase start;
  std::size_t plant = 0;  ///< number of its plant among those of the call
};

class LoopSource {
 public:
  LoopSource() = default;
  LoopSource(const LoopSource&) = delete;
  LoopSource& operator=(const LoopSource&) = delete;
  virtual ~LoopSource();

  /// The next run. False: none now; a result may bring more.
  virtual bool next(LoopRun& run) = 0;
  /// Takes the result of a run, in any order.
  virtual void take(std::size_t number, const LoopResult& result) = 0;
  /// No run has a longer delay.
  virtual double longest_delay_s() const = 0;
};

}  // namespace upright
