// Which runs are held out.
#include "estimation/held_out.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace upright {
namespace {

/// A cart that swings, with this amplitude.
Measurement swing(double amplitude_m) {
  Measurement run;
  for (int k = 0; k <= 400; ++k) {
    const double t_s = 0.005 * k;
    run.time_s.push_back(t_s);
    run.voltage_v.push_back(0.0);
    run.cart_m.push_back(amplitude_m * std::sin(6.0 * t_s));
  }
  return run;
}

/// As many runs as there are ranks. The run of rank r has the r-th smallest amplitude.
std::vector<Measurement> runs_of(const std::vector<std::size_t>& ranks) {
  std::vector<Measurement> runs;
  for (const std::size_t rank : ranks) runs.push_back(swing(0.01 * static_cast<double>(rank + 1)));
  return runs;
}

/// The ranks of the runs that are held out, in rising order.
std::vector<std::size_t> held_ranks(const std::vector<std::size_t>& ranks, HeldOut which) {
  constexpr double arm_m = 0.3, speed_window_s = 0.02;
  std::vector<std::size_t> held;
  for (const std::size_t run : split(runs_of(ranks), which, arm_m, speed_window_s).held_out_runs)
    held.push_back(ranks[run]);
  std::sort(held.begin(), held.end());
  return held;
}

using Ranks = std::vector<std::size_t>;

TEST(HeldOutRuns, AreTheMiddleOfEachThree) {
  EXPECT_EQ(held_ranks({0, 1}, HeldOut::middle), Ranks({0}));
  EXPECT_EQ(held_ranks({0, 1}, HeldOut::other), Ranks({1}));
  EXPECT_EQ(held_ranks({2, 0, 1}, HeldOut::middle), Ranks({1}));
  EXPECT_EQ(held_ranks({2, 0, 1}, HeldOut::other), Ranks({0}));
  EXPECT_EQ(held_ranks({4, 2, 0, 1, 3}, HeldOut::middle), Ranks({1, 3}));
  EXPECT_EQ(held_ranks({4, 2, 0, 1, 3}, HeldOut::other), Ranks({0, 2}));
}

TEST(HeldOutRuns, LeaveTheMostExcitedOneToTheFit) {
  std::mt19937 random(8);
  for (std::size_t count = 3; count <= 12; ++count) {
    Ranks ranks(count);
    std::iota(ranks.begin(), ranks.end(), std::size_t{0});
    std::shuffle(ranks.begin(), ranks.end(), random);
    const Ranks middle = held_ranks(ranks, HeldOut::middle), other = held_ranks(ranks, HeldOut::other);
    Ranks both;
    std::set_intersection(middle.begin(), middle.end(), other.begin(), other.end(), std::back_inserter(both));
    EXPECT_TRUE(both.empty()) << count << " runs: the others hold out what the middle ones show";
    for (const Ranks& held : {middle, other}) {
      EXPECT_LT(held.back(), count - 1) << count << " runs";
      EXPECT_GE(3 * held.size() + 2, count) << count << " runs";
      EXPECT_LE(2 * held.size(), count) << count << " runs";
    }
  }
}

TEST(HeldOutRuns, AreComparedByTheirLargestVoltage) {
  std::vector<Measurement> runs = runs_of({0, 1, 2});
  const auto is_held_out = [&] {
    return largest_voltage_is_held_out(split(runs, HeldOut::middle, 0.3, 0.02));
  };
  EXPECT_FALSE(is_held_out());
  runs[1].voltage_v[200] = -3.0;
  EXPECT_TRUE(is_held_out());
  runs[2].voltage_v[100] = 3.0;
  EXPECT_FALSE(is_held_out());
  runs.resize(1);
  EXPECT_FALSE(is_held_out());
}

}  // namespace
}  // namespace upright
