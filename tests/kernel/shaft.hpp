// An encoder's shaft, whose edges go to two lines of a simulated chip.
#pragma once

#include <cstdint>

#include "gpio_sim.hpp"
#include "upright/hal/clock.hpp"

namespace upright::test {

class Shaft {
 public:
  Shaft(GpioSim& sim, int a, int b) : sim_(sim), a_(a), b_(b) { pull(); }

  std::int64_t counts() const { return counts_; }
  /// One edge after the other, as fast as the machine goes.
  void turn_to(std::int64_t counts) {
    while (counts_ != counts) {
      counts_ += counts > counts_ ? 1 : -1;
      pull();
    }
  }
  /// The same at a steady rate, or as near to it as the machine comes; returns the edges per second it came
  /// to.
  double turn_to(std::int64_t counts, double edges_per_s) {
    const std::int64_t begun_ns = clock_.now_ns(), first = counts_;
    const auto step_ns = static_cast<std::int64_t>(1e9 / edges_per_s);
    for (std::int64_t step = 1; counts_ != counts; ++step) {
      clock_.sleep_until(begun_ns + step * step_ns);
      turn_to(counts_ + (counts > counts_ ? 1 : -1));
    }
    const double edges = static_cast<double>(counts > first ? counts - first : first - counts);
    return edges * 1e9 / static_cast<double>(clock_.now_ns() - begun_ns);
  }

 private:
  void pull() {
    const std::int64_t quarter = counts_ & 3;
    set(a_, is_a_high_, quarter == 1 || quarter == 2);
    set(b_, is_b_high_, quarter >= 2);
  }
  void set(int line, bool& is_high, bool high) {
    if (is_high == high) return;
    is_high = high;
    sim_.pull(line, high);
  }

  GpioSim& sim_;
  MonotonicClock clock_;
  int a_, b_;
  bool is_a_high_ = false, is_b_high_ = false;
  std::int64_t counts_ = 0;
};

}  // namespace upright::test
