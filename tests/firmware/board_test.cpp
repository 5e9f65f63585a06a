// The firmware on both boards: registers, pins, and what it does by itself. All in the processor's own time.
#include "board.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "modbus_master.hpp"

namespace upright::test {
namespace {

constexpr int cart = 0, boot_count = 4, status = 5, sequence = 6, sample = 9, voltage = 16, enable = 17,
              watchdog = 18, sample_period = 19;
constexpr std::uint16_t emergency_bit = 1, plus_bit = 2, minus_bit = 4, lost_bit = 8, watchdog_bit = 16;
constexpr double begin_s = 0.02;  // the EEPROM takes its time
constexpr double pwm_step_v = Board::supply_v / 800;

std::uint16_t millivolts(double voltage_v) {
  return static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(1e3 * voltage_v)));
}

class Firmware : public testing::TestWithParam<const BoardPins*> {
 protected:
  Firmware() { board.run_for(begin_s); }

  std::uint16_t read(int address) {
    const auto words = words_in(master.ask(reading(3, address, 1)));
    EXPECT_TRUE(words && words->size() == 1);
    return words ? words->at(0) : 0xdead;
  }
  void write(int address, int word) {
    EXPECT_EQ(master.ask(writing(address, {static_cast<std::uint16_t>(word)})).size(), 8u);
  }
  void drive(double voltage_v) {
    write(voltage, millivolts(voltage_v));
    write(enable, 1);
  }
  std::pair<std::int64_t, std::int64_t> counts() {
    const auto words = words_in(master.ask(reading(3, cart, 4)));
    EXPECT_TRUE(words && words->size() == 4);
    if (!words) return {-1, -1};
    const auto at = [&](std::size_t i) {
      return static_cast<std::int32_t>(static_cast<std::uint32_t>((*words)[i]) << 16 | (*words)[i + 1]);
    };
    return {at(0), at(2)};
  }
  /// Over whole periods, from now on.
  double voltage_now() {
    board.run_until(board.now() + 2 * Board::pwm_cycles);
    board.mean_v();
    board.run_until(board.now() + 20 * Board::pwm_cycles);
    return board.mean_v();
  }

  Board board{*GetParam()};
  ModbusMaster master{board};
};

TEST_P(Firmware, PutsOutNothingUntilItIsEnabled) {
  EXPECT_EQ(board.last_on(), 0u);
  write(voltage, 5000);
  EXPECT_EQ(voltage_now(), 0.0);
  EXPECT_EQ(read(voltage), 5000);
  write(enable, 1);
  EXPECT_NEAR(voltage_now(), 5.0, 2 * pwm_step_v);
}

TEST_P(Firmware, GivesTheVoltageThatWasAskedFor) {
  drive(0.0);
  for (const double voltage_v : {0.03, 1.0, -1.0, 6.0, -11.9, 11.99, 0.0, -12.0, 12.0, 20.0, -32.768}) {
    write(voltage, millivolts(voltage_v));
    const double expected_v = std::clamp(voltage_v, -Board::supply_v, Board::supply_v);
    EXPECT_NEAR(voltage_now(), expected_v, 2 * pwm_step_v) << voltage_v;
    EXPECT_EQ(read(voltage), millivolts(voltage_v));
  }
}

TEST_P(Firmware, CountsBothEncodersInBothDirections) {
  const Board::Cycles spacing = Board::hz / 30'000;
  std::mt19937 random(1);
  std::uniform_int_distribution<int> far(-2000, 2000);
  for (int i = 0; i < 30; ++i) {
    board.turn_to(Encoder::cart, board.counts(Encoder::cart) + far(random), spacing);
    board.turn_to(Encoder::pendulum, board.counts(Encoder::pendulum) + far(random), spacing + 7);
    board.run_for(0.08);
    EXPECT_EQ(counts(), std::make_pair(board.counts(Encoder::cart), board.counts(Encoder::pendulum)));
  }
  EXPECT_EQ(read(status), 0);
}

TEST_P(Firmware, CountsIn32Bits) {
  board.turn_to(Encoder::cart, -70'000, Board::hz / 80'000);
  board.turn_to(Encoder::pendulum, 70'000, Board::hz / 80'000);
  board.run_for(0.9);
  EXPECT_EQ(counts(), std::make_pair(std::int64_t{-70'000}, std::int64_t{70'000}));
}

TEST_P(Firmware, KnowsTheFourFunctionsAndTheSingleWrite) {
  drive(0.0);
  EXPECT_EQ(words_in(master.ask(reading(4, voltage, 3))), words_in(master.ask(reading(3, voltage, 3))));
  EXPECT_EQ(master.ask(writing_one(watchdog, 250)), writing_one(watchdog, 250));
  EXPECT_EQ(read(watchdog), 250);
  const auto words = words_in(master.ask(exchanging(cart, 7, voltage, {millivolts(3.0)})));
  ASSERT_TRUE(words.has_value());
  EXPECT_EQ(words->size(), 7u);
  EXPECT_EQ(words->at(boot_count), read(boot_count));
  EXPECT_NEAR(voltage_now(), 3.0, 2 * pwm_step_v);
}

TEST_P(Firmware, NumbersItsReadings) {
  const std::uint16_t first = read(sequence);
  EXPECT_EQ(read(sequence), static_cast<std::uint16_t>(first + 1));
}

TEST_P(Firmware, AnswersWithItsNextSample) {
  constexpr double period_s = 0.002, jitter_s = 150e-6;  // a round of the loop, and the emulator's bytes
  constexpr int samples = 200;
  write(sample_period, 2000);
  const Bytes request = exchanging(cart, 10, voltage, {millivolts(2.0)});
  std::uint16_t number = words_in(master.ask(request, 0.01)).value().at(sample);
  const double first_s = master.replied_s();
  for (int i = 1; i <= samples; ++i) {
    board.turn_to(Encoder::cart, 10 * i, Board::hz / 40'000);
    const auto words = words_in(master.ask(request, 0.01));
    ASSERT_TRUE(words && words->size() == 10);
    EXPECT_EQ(words->at(sample), ++number);
    EXPECT_NEAR(master.replied_s(), first_s + period_s * i, jitter_s);
    EXPECT_EQ(words->at(1), 10 * i) << "counts of the sample, not of the request";
  }
  EXPECT_EQ(read(voltage), millivolts(2.0));
}

TEST_P(Firmware, CountsSamplesThatNobodyWaitsFor) {
  write(sample_period, 2000);
  const auto number = [&] { return words_in(master.ask(reading(3, sample, 1), 0.01)).value().at(0); };
  const std::uint16_t before = number();
  board.run_for(0.0205);
  EXPECT_EQ(number(), before + 11);
}

TEST_P(Firmware, AWaitingRequestEndsWithTheNextByte) {
  write(sample_period, 20'000);
  master.ask(reading(3, sample, 1), 0.03);  // just after a sample
  EXPECT_TRUE(master.ask(reading(3, cart, 10)).empty());
  EXPECT_EQ(master.ask(reading(3, boot_count, 1)).size(), 7u);
  EXPECT_TRUE(master.ask({0x55}, 0.03).empty()) << "the request that waited is not answered any more";
}

TEST_P(Firmware, RefusesWhatNoSampleCanAnswer) {
  EXPECT_EQ(master.ask(reading(3, sample, 1)), refusal(3, 2)) << "as after a restart";
  EXPECT_EQ(master.ask(writing(sample_period, {499})), refusal(0x10, 3));
  write(sample_period, 500);
  EXPECT_EQ(master.ask(exchanging(sample, 1, sample_period, {0})), refusal(0x17, 3));
  EXPECT_EQ(read(sample_period), 500);
  write(sample_period, 0);
  EXPECT_EQ(master.ask(reading(3, sample, 1)), refusal(3, 2));
  write(sample_period, 2000);
  board.brown_out();
  board.run_for(begin_s);
  EXPECT_EQ(read(sample_period), 0);
}

TEST_P(Firmware, RefusesWhatItCannotDo) {
  EXPECT_EQ(master.ask(framed({1, 0x2b, 0x0e, 1, 0})), refusal(0x2b, 1));
  EXPECT_EQ(master.ask(reading(3, 9, 1)), refusal(3, 2));
  EXPECT_EQ(master.ask(reading(3, 0, 10)), refusal(3, 2));
  EXPECT_EQ(master.ask(reading(3, 0, 0)), refusal(3, 3));
  EXPECT_EQ(master.ask(reading(3, 65535, 2)), refusal(3, 2));
  EXPECT_EQ(master.ask(writing(cart, {1})), refusal(0x10, 2));
  EXPECT_EQ(master.ask(writing(watchdog, {1, 0, 1})), refusal(0x10, 2));
  EXPECT_EQ(master.ask(writing(watchdog, {0})), refusal(0x10, 3));
  EXPECT_EQ(master.ask(writing(enable, {2})), refusal(0x10, 3));
  drive(0.0);
  EXPECT_EQ(master.ask(exchanging(0, 10, voltage, {5000})), refusal(0x17, 2));
  EXPECT_EQ(master.ask(writing(voltage, {5000, 7})), refusal(0x10, 3));
  EXPECT_EQ(voltage_now(), 0.0) << "nothing of a refused request is done";
}

TEST_P(Firmware, TakesTheVoltageAwayWhenNoRequestComes) {
  write(watchdog, 50);
  drive(6.0);
  const double asked_s = board.now_s();
  board.run_for(0.2);
  const double off_s = static_cast<double>(board.last_on()) / Board::hz;
  EXPECT_GT(off_s, asked_s + 0.047);
  EXPECT_LT(off_s, asked_s + 0.0505);
  EXPECT_EQ(read(status), watchdog_bit);
  EXPECT_EQ(read(voltage), 0);
  EXPECT_EQ(voltage_now(), 0.0);
}

TEST_P(Firmware, HasAWatchdogThatNobodyProgrammed) {
  EXPECT_EQ(read(watchdog), 0) << "as after a restart";
  drive(6.0);
  const double asked_s = board.now_s();
  board.run_for(0.3);
  EXPECT_NEAR(static_cast<double>(board.last_on()) / Board::hz, asked_s + 0.1, 0.003);
}

TEST_P(Firmware, NeitherNoiseNorRefusedRequestsFeedTheWatchdog) {
  drive(6.0);
  const double asked_s = board.now_s();
  Bytes wrong = reading(3, 0, 5);
  wrong[3] ^= 1;
  for (int i = 0; i < 60; ++i) {
    master.ask(wrong);
    master.ask(reading(3, 9, 1));
  }
  EXPECT_GT(board.now_s(), asked_s + 0.12);
  EXPECT_LT(static_cast<double>(board.last_on()) / Board::hz, asked_s + 0.101);
}

TEST_P(Firmware, AWholeRequestFeedsTheWatchdogWhateverFollows) {
  constexpr double watchdog_s = 0.02, before_s = 0.0012;
  drive(6.0);
  write(watchdog, 20);
  board.run_for(watchdog_s - before_s);
  Bytes burst = reading(3, 0, 1);
  const double whole_s = board.now_s() + static_cast<double>(burst.size() * Board::byte_cycles) / Board::hz;
  burst.resize(burst.size() + 100);  // 2 ms more, of bytes that are no request
  board.send(burst);
  while (board.line_is_busy()) board.run_for(1e-4);
  EXPECT_GT(board.now_s(), whole_s + before_s);
  EXPECT_NEAR(voltage_now(), 6.0, 2 * pwm_step_v);
  board.run_for(watchdog_s);
  EXPECT_NEAR(static_cast<double>(board.last_on()) / Board::hz, whole_s + watchdog_s, 0.0003);
}

TEST_P(Firmware, StopInputsTakeTheVoltageAwayAtOnceAndForGood) {
  const std::array<std::pair<StopInput, std::uint16_t>, 3> inputs = {
      {{StopInput::emergency, emergency_bit}, {StopInput::plus, plus_bit}, {StopInput::minus, minus_bit}}};
  for (const auto& [input, bit] : inputs) {
    drive(6.0);
    const double pressed_s = board.now_s();
    board.press(input, true);
    board.run_for(0.001);
    board.press(input, false);
    EXPECT_LT(static_cast<double>(board.last_on()) / Board::hz, pressed_s + 0.0003);
    EXPECT_EQ(read(status), bit);
    drive(6.0);
    EXPECT_EQ(voltage_now(), 0.0) << "enabling alone does not help";
    EXPECT_EQ(read(enable), 0);
    write(enable, 0);
    EXPECT_EQ(read(status), 0);
    board.press(input, true);
    board.run_for(0.001);
    write(enable, 0);
    EXPECT_EQ(read(status), bit) << "still pressed";
    board.press(input, false);
    write(enable, 0);
  }
  drive(6.0);
  EXPECT_NEAR(voltage_now(), 6.0, 2 * pwm_step_v);
}

TEST_P(Firmware, ShowsWhatIsPressedWhileTheMotorIsDisabled) {
  board.press(StopInput::plus, true);
  board.run_for(0.001);
  EXPECT_EQ(read(status), plus_bit);
  board.press(StopInput::plus, false);
  board.run_for(0.001);
  EXPECT_EQ(read(status), 0) << "a switch that is tested by hand need not be acknowledged";
  drive(6.0);
  EXPECT_NEAR(voltage_now(), 6.0, 2 * pwm_step_v);
}

TEST_P(Firmware, AnInputThatIsNotWiredIsPressed) {
  board.press(StopInput::minus, true);  // its pull-up makes it so
  board.brown_out();
  board.run_for(begin_s);
  drive(6.0);
  EXPECT_EQ(voltage_now(), 0.0);
  EXPECT_EQ(read(status), minus_bit);
}

TEST_P(Firmware, ASpikeOnAStopInputIsNoStop) {
  drive(6.0);
  board.press(StopInput::emergency, true);
  board.run_for(20e-6);
  board.press(StopInput::emergency, false);
  board.run_for(0.001);
  EXPECT_EQ(read(status), 0);
}

TEST_P(Firmware, SaysThatItLostEdgesAndGivesNoCountsAnyMore) {
  drive(6.0);
  const double begun_s = board.now_s();
  board.turn_to(Encoder::cart, 4000, Board::hz / 200'000);  // one or two edges between two samples
  board.run_for(0.02);
  EXPECT_LT(static_cast<double>(board.last_on()) / Board::hz, begun_s + 0.001);
  EXPECT_EQ(read(status), lost_bit);
  EXPECT_EQ(master.ask(reading(3, 0, 5)), refusal(3, 4));
  EXPECT_EQ(master.ask(exchanging(0, 5, voltage, {0})), refusal(0x17, 4));
  write(enable, 0);
  drive(6.0);
  EXPECT_EQ(voltage_now(), 0.0);
  EXPECT_EQ(read(status), lost_bit) << "until the next reset";
  board.brown_out();
  board.run_for(begin_s);
  EXPECT_EQ(read(status), 0);
  EXPECT_EQ(counts().first, 0);
}

TEST_P(Firmware, ARestartShowsAndPutsOutNothing) {
  const std::uint16_t boots = read(boot_count);
  write(watchdog, 200);
  drive(6.0);
  board.turn_to(Encoder::cart, 1001, Board::hz / 40'000);
  board.run_for(0.04);
  const Board::Cycles cut = board.now();
  board.brown_out();
  board.run_for(begin_s);
  EXPECT_LE(board.last_on(), cut);
  EXPECT_EQ(read(boot_count), static_cast<std::uint16_t>(boots + 1));
  EXPECT_EQ(read(enable), 0);
  EXPECT_EQ(read(voltage), 0);
  EXPECT_EQ(read(watchdog), 0);
  EXPECT_EQ(counts().first, 0) << "wherever the lines are";
  EXPECT_EQ(read(status), 0);
}

TEST_P(Firmware, AProgramGoneAstrayIsReset) {
  const std::uint16_t boots = read(boot_count);
  drive(6.0);
  const double hung_s = board.now_s();
  board.hang();
  board.run_for(0.1);
  EXPECT_LT(static_cast<double>(board.last_on()) / Board::hz, hung_s + 0.02);
  EXPECT_EQ(read(boot_count), static_cast<std::uint16_t>(boots + 1));
  EXPECT_EQ(voltage_now(), 0.0);
}

TEST_P(Firmware, IsBackInStepAfterHalfARequest) {
  Bytes request = exchanging(0, 5, voltage, {0});
  for (std::size_t size = 1; size < request.size(); ++size) {
    EXPECT_TRUE(
        master.ask(Bytes(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(size))).empty());
    EXPECT_EQ(master.ask(request).size(), 15u) << size;
  }
}

TEST_P(Firmware, AnswersOnlyWhatIsMeantForIt) {
  Bytes other = reading(3, 0, 5);
  other[0] = 2;
  other.resize(6);
  EXPECT_TRUE(master.ask(framed(other)).empty());
  other[0] = 0;
  other.resize(6);
  EXPECT_TRUE(master.ask(framed(other)).empty());
  EXPECT_EQ(master.ask(reading(3, 0, 5)).size(), 15u);
}

INSTANTIATE_TEST_SUITE_P(, Firmware, testing::Values(&uno_pins(), &mega_pins()),
                         [](const auto& item) { return std::string(item.param->processor); });

}  // namespace
}  // namespace upright::test
