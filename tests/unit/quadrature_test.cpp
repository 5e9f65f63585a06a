// The decoder of line encoders: every transition, and every way to notice that edges are missing.
#include "../../hal/gpio/quadrature.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace upright {
namespace {

constexpr double rate = 1000.0;               // edges per second, at most
constexpr std::int64_t apart_ns = 2'000'000;  // edges at half of it

constexpr bool line_b = true, line_a = false;

class Quadrature : public ::testing::Test {
 protected:
  RigFault edge(bool of_b, bool level) { return decoder.take({of_b, level, now_ns += apart_ns}); }
  /// One cycle of four counts, A first.
  void turn_up() {
    edge(line_a, true);
    edge(line_b, true);
    edge(line_a, false);
    edge(line_b, false);
  }

  QuadratureDecoder decoder{rate};
  std::int64_t now_ns = 1'000'000'000;
};

TEST_F(Quadrature, CountsUpWhereALeadsAndDownWhereBDoes) {
  decoder.start({false, false});
  turn_up();
  turn_up();
  EXPECT_EQ(decoder.counts(), 8);
  for (const bool level : {true, false, true}) {
    edge(line_b, level);
    edge(line_a, level);
  }
  EXPECT_EQ(decoder.counts(), 2);
  EXPECT_EQ(decoder.fault(), RigFault::none);
}

TEST_F(Quadrature, StartsAtAnyLevels) {
  for (const LinePair levels : {LinePair{false, false}, {true, false}, {false, true}, {true, true}}) {
    decoder.start(levels);
    edge(line_a, !levels.a);
    edge(line_a, levels.a);
    EXPECT_EQ(decoder.counts(), 0) << "back where it was";
    EXPECT_EQ(decoder.levels(), levels);
  }
}

TEST_F(Quadrature, AnEdgeToTheLevelThatIsThereAlreadyIsALoss) {
  decoder.start({false, false});
  turn_up();
  EXPECT_EQ(edge(line_b, false), RigFault::edges_lost);
  EXPECT_EQ(edge(line_b, true), RigFault::edges_lost) << "it stays";
  EXPECT_EQ(decoder.compare({true, true}, now_ns), RigFault::edges_lost);
  decoder.start({false, false});
  EXPECT_EQ(decoder.fault(), RigFault::none);
}

TEST_F(Quadrature, LevelsThatStayDifferentAreALoss) {
  decoder.start({false, false});
  EXPECT_EQ(decoder.compare({true, false}, now_ns), RigFault::none) << "the edge may be on its way";
  EXPECT_EQ(decoder.compare({true, false}, now_ns + QuadratureDecoder::settling_ns), RigFault::none);
  EXPECT_EQ(decoder.compare({true, false}, now_ns + QuadratureDecoder::settling_ns + 1),
            RigFault::edges_lost);
}

TEST_F(Quadrature, LevelsMayBeAheadOfTheEdges) {
  decoder.start({false, false});
  for (int i = 0; i < 100; ++i) {
    const bool high = i % 2 == 0;
    EXPECT_EQ(decoder.compare({high, false}, now_ns), RigFault::none);
    edge(line_a, high);
    now_ns += QuadratureDecoder::settling_ns;
  }
  EXPECT_EQ(decoder.compare({false, false}, now_ns), RigFault::none);
  EXPECT_EQ(decoder.compare({false, false}, now_ns + 10 * apart_ns), RigFault::none) << "they match";
}

/// Edges at a steady rate until one is refused; at most two seconds of them.
RigFault turned_at(double edges_per_s, QuadratureDecoder& decoder) {
  decoder.start({false, false});
  const auto step_ns = static_cast<std::int64_t>(1e9 / edges_per_s);
  LinePair levels;
  for (std::int64_t time_ns = 0; time_ns < 2'000'000'000; time_ns += step_ns) {
    const bool of_b = levels.a != levels.b;
    bool& line = of_b ? levels.b : levels.a;
    line = !line;
    if (const RigFault fault = decoder.take({of_b, line, time_ns}); fault != RigFault::none) return fault;
  }
  return RigFault::none;
}

TEST_F(Quadrature, TheRateLimitIsWhereItIsSaidToBe) {
  for (const double limit : {500.0, 1000.0, 8000.0, 20000.0}) {
    QuadratureDecoder limited(limit);
    EXPECT_EQ(turned_at(0.98 * limit, limited), RigFault::none) << limit;
    EXPECT_EQ(turned_at(1.02 * limit, limited), RigFault::edges_too_fast) << limit;
    EXPECT_EQ(limited.compare(limited.levels(), 0), RigFault::edges_too_fast) << "it stays";
  }
}

TEST_F(Quadrature, AShortBurstIsNoRate) {
  decoder.start({false, false});
  bool level = false;
  for (int i = 0; i < 8; ++i) EXPECT_EQ(decoder.take({line_a, level = !level, now_ns}), RigFault::none);
  now_ns += 500 * apart_ns;
  for (int i = 0; i < 8; ++i) EXPECT_EQ(decoder.take({line_a, level = !level, now_ns}), RigFault::none);
}

Edge numbered(std::uint32_t number) {
  return {number % 2 == 0, number % 4 < 2, number};
}

TEST(EdgeSequence, PutsEdgesThatOvertookOthersBehindThem) {
  EdgeSequence sequence;
  sequence.start(1);
  std::vector<std::int64_t> seen;
  Edge edge;
  for (const std::uint32_t number : {2u, 1u, 3u, 6u, 5u, 4u, 7u}) {
    EXPECT_TRUE(sequence.put(number, numbered(number)));
    while (sequence.next(edge)) seen.push_back(edge.time_ns);
  }
  EXPECT_EQ(seen, (std::vector<std::int64_t>{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_FALSE(sequence.waits());
}

TEST(EdgeSequence, KeepsWhatComesAfterAGapAndSaysSo) {
  EdgeSequence sequence;
  sequence.start(1);
  Edge edge;
  EXPECT_TRUE(sequence.put(1, numbered(1)));
  EXPECT_TRUE(sequence.next(edge));
  EXPECT_TRUE(sequence.put(3, numbered(3)));
  EXPECT_FALSE(sequence.next(edge));
  EXPECT_TRUE(sequence.waits());
}

TEST(EdgeSequence, RefusesWhatIsTooFarAheadOrWasThere) {
  EdgeSequence sequence;
  sequence.start(1);
  Edge edge;
  EXPECT_FALSE(sequence.put(1 + 64, numbered(65)));
  EXPECT_TRUE(sequence.put(1, numbered(1)));
  EXPECT_FALSE(sequence.put(1, numbered(1))) << "twice";
  EXPECT_TRUE(sequence.next(edge));
  EXPECT_FALSE(sequence.put(1, numbered(1))) << "it has passed";
}

TEST(EdgeSequence, NumbersWrap) {
  EdgeSequence sequence;
  sequence.start(0xfffffffe);
  Edge edge;
  for (const std::uint32_t number : {0xffffffffu, 0xfffffffeu, 1u, 0u}) EXPECT_TRUE(sequence.put(number, {}));
  int seen = 0;
  while (sequence.next(edge)) ++seen;
  EXPECT_EQ(seen, 4);
}

}  // namespace
}  // namespace upright
