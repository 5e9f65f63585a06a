// How fast edges may come, and what comes of faster ones: right counts, or none.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "board.hpp"
#include "modbus_master.hpp"

namespace upright::test {
namespace {

constexpr double begin_s = 0.02;
/// What docs/how-to/build-a-board.md promises.
constexpr int promised_edges_per_s = 110'000;

std::int32_t count_at(const Words& words, std::size_t place) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(words[place]) << 16 | words[place + 1]);
}

/// Both encoders at this rate, forth and back, while request follows request. True: it counted all.
bool counts_all(const BoardPins& pins, double edges_per_s, std::uint32_t seed) {
  Board board(pins);
  ModbusMaster master(board);
  board.run_for(begin_s);
  std::mt19937 random(seed);
  const auto spacing = static_cast<Board::Cycles>(Board::hz / edges_per_s);
  for (const int turn : {1, -1}) {
    constexpr double turn_s = 0.15;
    const auto edges = static_cast<std::int64_t>(edges_per_s * turn_s);
    board.turn_to(Encoder::cart, turn * edges, spacing);
    board.run_until(board.now() + random() % spacing);
    board.turn_to(Encoder::pendulum, -turn * edges, spacing);
    const double until_s = board.now_s() + 2.2 * turn_s;
    while (board.now_s() < until_s)
      if (!words_in(master.ask(exchanging(0, 6, 16, {0})))) return false;
  }
  const auto words = words_in(master.ask(reading(3, 0, 6)));
  return words && count_at(*words, 0) == board.counts(Encoder::cart) &&
         count_at(*words, 2) == board.counts(Encoder::pendulum) && words->at(5) == 0;
}

class Edges : public testing::TestWithParam<const BoardPins*> {};

TEST_P(Edges, AreAllCountedUpToTheRatePromised) {
  for (std::uint32_t seed = 0; seed < 3; ++seed)
    EXPECT_TRUE(counts_all(*GetParam(), promised_edges_per_s, seed));
  EXPECT_TRUE(counts_all(*GetParam(), 44'000, 7)) << "a cart at 1 m/s";
  constexpr int step = 1'000;
  int largest = promised_edges_per_s;
  while (counts_all(*GetParam(), largest + step, 3)) largest += step;
  std::printf("%s counts %d edges/s on both encoders at once\n", GetParam()->processor, largest);
}

/// Far beyond what any shaft does: from half the rate promised to five times it within 50 ms.
TEST_P(Edges, ThatComeTooFastGiveNoCountsInsteadOfWrongOnes) {
  for (int seed = 0; seed < 8; ++seed) {
    Board board(*GetParam());
    ModbusMaster master(board);
    board.run_for(begin_s + 1e-6 * seed);
    constexpr double speeding_up_s = 0.05;
    const double begun_s = board.now_s();
    bool refused = false;
    std::int64_t target = 0;
    for (double share = 0.0; share < 1.0; share = (board.now_s() - begun_s) / speeding_up_s) {
      const double rate = promised_edges_per_s * (0.5 + 4.5 * share);
      target += 1'000'000;  // it never gets there
      board.turn_to(Encoder::cart, target, static_cast<Board::Cycles>(Board::hz / rate));
      const std::int64_t before = board.counts(Encoder::cart);
      const Bytes reply = master.ask(reading(3, 0, 2));
      if (const auto words = words_in(reply)) {
        EXPECT_FALSE(refused) << "once lost, lost for good";
        EXPECT_GE(count_at(*words, 0), before - 1);
        EXPECT_LE(count_at(*words, 0), board.counts(Encoder::cart));
      } else {
        EXPECT_EQ(reply, refusal(3, 4));
        refused = true;
      }
    }
    EXPECT_TRUE(refused);
  }
}

/// An encoder's lines as noise has them, as fast as it likes: the board goes on answering and stops the
/// motor.
TEST_P(Edges, NoiseOnTheLinesKeepsTheBoardFromNothing) {
  Board board(*GetParam());
  ModbusMaster master(board);
  board.run_for(begin_s);
  std::mt19937 random(5);
  EXPECT_EQ(master.ask(writing(16, {6000, 1})).size(), 8u);
  for (int i = 0; i < 2000; ++i) {
    board.put_lines(Encoder::pendulum, static_cast<int>(random() & 3u));
    board.run_until(board.now() + random() % 100);
  }
  const double disturbed_s = board.now_s();
  EXPECT_EQ(master.ask(reading(3, 0, 5)), refusal(3, 4));
  EXPECT_EQ(words_in(master.ask(reading(3, 5, 1))), Words{8});
  EXPECT_LT(static_cast<double>(board.last_on()) / Board::hz, disturbed_s);
}

INSTANTIATE_TEST_SUITE_P(, Edges, testing::Values(&uno_pins(), &mega_pins()),
                         [](const auto& item) { return std::string(item.param->processor); });

}  // namespace
}  // namespace upright::test
