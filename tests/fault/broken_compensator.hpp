// A controller that computes nonsense: the program has no way to be told to.
#pragma once

#include <atomic>
#include <limits>

#include "upright/control/controller.hpp"
#include "upright/hal/clock.hpp"

namespace upright::test {

/// Its estimate is not a number from a cycle on; `began_s` says since when, on the monotonic clock.
class BrokenCompensator final : public DelayCompensator {
 public:
  BrokenCompensator(int bad_cycle, std::atomic<double>& began_s) : bad_cycle_(bad_cycle), began_s_(began_s) {}
  void start(const ControlState&) noexcept override {}
  ControlState compensate(const ControlState& delayed, double) noexcept override {
    ControlState state = delayed;
    if (++cycle_ == bad_cycle_) began_s_ = 1e-9 * static_cast<double>(MonotonicClock().now_ns());
    if (cycle_ >= bad_cycle_) state.cart_velocity_mps = std::numeric_limits<double>::quiet_NaN();
    return state;
  }

 private:
  int bad_cycle_;
  std::atomic<double>& began_s_;
  int cycle_ = 0;
};

}  // namespace upright::test
