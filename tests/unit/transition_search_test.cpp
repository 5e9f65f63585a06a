// The search for transitions: results may come in any order, and lanes take the runs that results bring.
#include "sweep/transition_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/loop/fast_loop.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double oscillates_s = 0.0123456, falls_s = 0.0345678;

SweepConfig config_with_delays(std::size_t count, double step_s) {
  SweepConfig config;
  for (std::size_t i = 0; i < count; ++i) config.delay_s.push_back(step_s * static_cast<double>(i));
  return config;
}

SweepRun run_of(const LoopCase& start) {
  return {start, start.delay_s >= falls_s ? 1.0 : nan, start.delay_s >= oscillates_s ? 0.1 : 0.0, 0.0};
}

TEST(TransitionSearch, FindsBothTransitionsInEitherOrderOfResults) {
  const SweepConfig config = config_with_delays(51, 0.001);
  for (const bool last_first : {false, true}) {
    StartSearch search(config, 0.05);
    std::size_t made = 0;
    while (search.open() > 0) {
      std::vector<SweepRun> asked;
      while (const auto wanted = search.next()) asked.push_back(run_of(*wanted));
      ASSERT_FALSE(asked.empty());
      ASSERT_FALSE(search.next());
      if (last_first) std::reverse(asked.begin(), asked.end());
      for (const SweepRun& run : asked) search.take(run);
      made += asked.size();
    }
    const Transition found = search.transition();
    EXPECT_GE(found.oscillates_from_s, oscillates_s);
    EXPECT_LE(found.oscillates_from_s, oscillates_s + transition_tolerance_s);
    EXPECT_GE(found.falls_from_s, falls_s);
    EXPECT_LE(found.falls_from_s, falls_s + transition_tolerance_s);
    EXPECT_LE(made, 20u);  // 51 delays take 6 runs and a millisecond 4, for each of two
  }
}

TEST(TransitionSearch, HasNoneOutsideOfTheDelays) {
  const SweepConfig config = config_with_delays(11, 0.001);
  StartSearch search(config, 0.05);
  while (const auto wanted = search.next()) search.take(run_of(*wanted));
  EXPECT_TRUE(std::isnan(search.transition().oscillates_from_s));
  EXPECT_TRUE(std::isnan(search.transition().falls_from_s));
  const SweepConfig one = config_with_delays(1, 0.001);
  StartSearch at_once(one, 0.05);
  while (const auto wanted = at_once.next()) at_once.take({*wanted, 1.0, 1.0, 0.0});
  EXPECT_EQ(at_once.transition().falls_from_s, 0.0);
}

TEST(TransitionSearch, FollowsOnlyTheRunsThatItNeeds) {
  const SweepConfig config = config_with_delays(11, 0.005);
  const StartSearch begin(config, 0.05);
  StartSearch search = begin;
  std::vector<SweepRun> runs;
  while (const auto wanted = search.next()) {
    runs.push_back(run_of(*wanted));
    search.take(runs.back());
  }
  std::reverse(runs.begin(), runs.end());
  std::vector<StartSearch> ended{begin};
  ASSERT_TRUE(follow({begin}, runs, ended));
  EXPECT_EQ(ended[0].transition().falls_from_s, search.transition().falls_from_s);
  ended = {begin};
  EXPECT_FALSE(follow({begin}, std::span(runs).subspan(1), ended));
  runs.push_back(run_of({0.05, 0.0499}));
  EXPECT_FALSE(follow({begin}, runs, ended));
  EXPECT_EQ(ended[0].open(), begin.open());
}

/// Gives a run for each result, so that all lanes but one have to wait.
class Chain final : public LoopSource {
 public:
  explicit Chain(std::vector<LoopCase> cases) : results(cases.size()), cases_(std::move(cases)) {}
  bool next(LoopRun& run) override {
    if (given_ > taken_ || given_ == cases_.size()) return false;
    run = {given_, cases_[given_]};
    ++given_;
    return true;
  }
  void take(std::size_t number, const LoopResult& result) override {
    EXPECT_EQ(number, taken_);
    results[number] = result;
    ++taken_;
  }
  double longest_delay_s() const override { return 0.08; }

  std::vector<LoopResult> results;

 private:
  std::vector<LoopCase> cases_;
  std::size_t given_ = 0, taken_ = 0;
};

TEST(LoopSource, LanesTakeTheRunsThatResultsBring) {
  LoopSetup setup;
  const std::string source = UPRIGHT_SOURCE_DIR;
  setup.model = make_model<double>(read_plant_file(source + "/config/plants/exponential.yaml"));
  setup.control = read_gain_file(source + "/config/gains/exponential.yaml");
  setup.angle_resolution_rad = 1.5e-3;
  setup.duration_s = 1.0;
  std::vector<LoopCase> cases;
  for (int i = 0; i < 7; ++i) cases.push_back({0.02 + 0.02 * i, 0.012 * i});
  for (const bool sampled : {true, false}) {
    setup.sampled = sampled;
    std::vector<LoopResult> together(cases.size());
    run_on_lanes(setup, cases, together);
    Chain chain(cases);
    run_source_on_lanes(setup, chain);
    for (std::size_t i = 0; i < cases.size(); ++i) {
      EXPECT_EQ(chain.results[i].end.theta_rad, together[i].end.theta_rad) << i;
      EXPECT_EQ(chain.results[i].theta_amplitude_rad, together[i].theta_amplitude_rad) << i;
    }
  }
}

}  // namespace
}  // namespace upright
