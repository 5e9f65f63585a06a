// Random walks of an encoder through the decoder: every count arrives, and what is lost on the way is
// noticed.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "../../hal/gpio/quadrature.hpp"

namespace upright {
namespace {

struct Numbered {
  std::uint32_t number = 0;
  Edge edge;
};

/// A shaft that turns at random, and the edges that it makes.
struct Walk {
  std::vector<Numbered> edges;
  std::int64_t position = 0;
  LinePair levels;
};

constexpr double fastest_edges_per_s = 10'000.0;

LinePair levels_at(std::int64_t position) {
  const std::int64_t quarter = position & 3;
  return {quarter == 1 || quarter == 2, quarter >= 2};
}

Walk walk(std::mt19937& random, int steps) {
  Walk walk;
  std::int64_t time_ns = 0;
  double drift = 0.5;
  for (int i = 0; i < steps; ++i) {
    if (i % 50 == 0) drift = std::uniform_real_distribution<>(0.0, 1.0)(random);
    const LinePair before = levels_at(walk.position);
    walk.position += std::bernoulli_distribution(drift)(random) ? 1 : -1;
    walk.levels = levels_at(walk.position);
    const bool of_b = before.a == walk.levels.a;
    time_ns += std::uniform_int_distribution<>(110'000, 1'000'000)(random);
    walk.edges.push_back(
        {static_cast<std::uint32_t>(i + 1), {of_b, of_b ? walk.levels.b : walk.levels.a, time_ns}});
  }
  return walk;
}

/// Neighbours change places, as when the later interrupt thread runs first.
void shuffle(std::vector<Numbered>& edges, std::mt19937& random) {
  for (std::size_t i = 1; i < edges.size(); ++i)
    if (edges[i].edge.of_b != edges[i - 1].edge.of_b && std::bernoulli_distribution(0.2)(random))
      std::swap(edges[i], edges[i - 1]);
}

/// What became of a walk: the fault, and the counts when there is none.
struct Decoded {
  RigFault fault = RigFault::none;
  std::int64_t counts = 0;
};

Decoded decode(const Walk& walk) {
  QuadratureDecoder decoder(fastest_edges_per_s);
  decoder.start({});
  EdgeSequence sequence;
  sequence.start(1);
  Edge edge;
  for (const Numbered& numbered : walk.edges) {
    if (!sequence.put(numbered.number, numbered.edge)) decoder.fail(RigFault::edges_lost);
    while (sequence.next(edge)) decoder.take(edge);
  }
  if (sequence.waits()) decoder.fail(RigFault::edges_lost);
  decoder.compare(walk.levels, 0);
  decoder.compare(walk.levels, 2 * QuadratureDecoder::settling_ns);
  return {decoder.fault(), decoder.counts()};
}

TEST(QuadratureWalk, EveryCountArrives) {
  std::mt19937 random(11);
  for (int i = 0; i < 200; ++i) {
    Walk w = walk(random, 2000);
    shuffle(w.edges, random);
    const Decoded decoded = decode(w);
    EXPECT_EQ(decoded.fault, RigFault::none);
    EXPECT_EQ(decoded.counts, w.position);
  }
}

TEST(QuadratureWalk, NoLossOfNumberedEdgesPassesUnnoticed) {
  std::mt19937 random(12);
  for (int i = 0; i < 500; ++i) {
    Walk w = walk(random, 400);
    const auto lost = std::uniform_int_distribution<std::ptrdiff_t>(1, 90)(random);
    const auto from = std::uniform_int_distribution<std::ptrdiff_t>(
        0, static_cast<std::ptrdiff_t>(w.edges.size()) - lost - 1)(random);
    w.edges.erase(w.edges.begin() + from, w.edges.begin() + from + lost);
    EXPECT_EQ(decode(w).fault, RigFault::edges_lost) << lost << " lost from " << from;
  }
}

TEST(QuadratureWalk, AnUnnoticedLossChangesCountsByWholeCycles) {
  // What levels alone can tell, and why a rate limit stands beside them.
  std::mt19937 random(13);
  int noticed = 0;
  constexpr int walks = 500;
  for (int i = 0; i < walks; ++i) {
    Walk w = walk(random, 400);
    const auto from = std::uniform_int_distribution<std::ptrdiff_t>(0, 380)(random);
    const auto lost = std::uniform_int_distribution<std::ptrdiff_t>(1, 8)(random);
    w.edges.erase(w.edges.begin() + from, w.edges.begin() + from + lost);
    std::uint32_t number = 0;
    for (Numbered& numbered : w.edges) numbered.number = ++number;
    const Decoded decoded = decode(w);
    if (decoded.fault == RigFault::edges_lost)
      ++noticed;
    else
      EXPECT_EQ((decoded.counts - w.position) % 4, 0);
  }
  EXPECT_GT(noticed, walks / 2);
}

}  // namespace
}  // namespace upright
