// Frames of every kind, right and wrong, against a second account of what the device has to do: never a wrong
// count, never a voltage that nobody asked for. UPRIGHT_FUZZ_S: seconds of the board's time, UPRIGHT_SEED:
// another stream.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "board.hpp"
#include "modbus_master.hpp"

namespace upright::test {
namespace {

double number_of(const char* variable, double otherwise) {
  const char* const text = std::getenv(variable);
  return text ? std::stod(text) : otherwise;
}

/// What the registers of the device hold, by the documentation of its map (docs/how-to/build-a-board.md).
class Account {
 public:
  struct Answer {
    Bytes reply;            ///< with zeros where the device's own numbers are
    std::vector<int> read;  ///< the addresses in it
  };

  /// What has to come of bytes that follow a silence and that a silence follows.
  std::vector<Answer> take(Bytes bytes, double now_s) {
    expire(now_s);
    shortest_watchdog_ms_ = watchdog_in_use_ms();
    std::vector<Answer> answers;
    while (bytes.size() >= 4 && bytes[0] == 1) {
      const std::size_t size = size_of(bytes);
      if (size > longest || size > bytes.size()) break;
      const Bytes frame(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      if (check_sum(frame) != 0) break;
      answers.push_back(answer(frame, now_s));
      bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    }
    return answers;
  }

  void expire(double now_s) {
    if (now_s >= expires_s()) voltage_mv_ = 0;
  }
  double expires_s() const { return fed_s_ + 1e-3 * watchdog_in_use_ms(); }
  int watchdog_in_use_ms() const { return watchdog_ms_ != 0 ? watchdog_ms_ : 100; }
  /// Of those in use since the last bytes began.
  int shortest_watchdog_ms() const { return shortest_watchdog_ms_; }
  double voltage_v() const {
    return enabled_ ? std::clamp(1e-3 * voltage_mv_, -Board::supply_v, Board::supply_v) : 0.0;
  }
  int value(int address) const {
    return address == 16 ? voltage_mv_ & 0xffff : address == 17 ? int{enabled_} : watchdog_ms_;
  }

 private:
  static constexpr std::size_t longest = 256;

  static std::size_t size_of(const Bytes& bytes) {
    const std::uint8_t function = bytes[1];
    if (function == 3 || function == 4 || function == 6) return 8;
    if (function == 0x10) return bytes.size() < 7 ? longest + 1 : 9u + bytes[6];
    if (function == 0x17) return bytes.size() < 11 ? longest + 1 : 13u + bytes[10];
    return bytes.size();
  }
  static int word(const Bytes& bytes, std::size_t place) { return 256 * bytes[place] + bytes[place + 1]; }
  static bool inside(int first, int count, int begin, int end) {
    return first >= begin && count >= 1 && first + count <= end;
  }
  static bool readable(int first, int count) {
    return inside(first, count, 0, 9) || inside(first, count, 16, 19);
  }

  Answer answer(const Bytes& frame, double now_s) {
    const int exception = obey(frame);
    if (exception != 0) return {refusal(frame[1], exception), {}};
    fed_s_ = now_s;
    Answer answer;
    if (frame[1] == 6 || frame[1] == 0x10) {
      answer.reply = framed(Bytes(frame.begin(), frame.begin() + 6));
      return answer;
    }
    answer.reply = {1, frame[1], static_cast<std::uint8_t>(2 * word(frame, 4))};
    for (int i = 0; i < word(frame, 4); ++i) answer.read.push_back(word(frame, 2) + i);
    return answer;
  }

  int obey(const Bytes& frame) {
    switch (frame[1]) {
      case 3:
      case 4:
        if (word(frame, 4) == 0) return 3;
        return readable(word(frame, 2), word(frame, 4)) ? 0 : 2;
      case 6:
        return write(word(frame, 2), Words{static_cast<std::uint16_t>(word(frame, 4))});
      case 0x10:
        if (word(frame, 4) == 0 || 2 * word(frame, 4) != frame[6]) return 3;
        return write(word(frame, 2), words(frame, 7, word(frame, 4)));
      case 0x17:
        if (word(frame, 4) == 0 || word(frame, 8) == 0 || 2 * word(frame, 8) != frame[10]) return 3;
        if (!readable(word(frame, 2), word(frame, 4))) return 2;
        return write(word(frame, 6), words(frame, 11, word(frame, 8)));
    }
    return 1;
  }

  static Words words(const Bytes& frame, std::size_t from, int count) {
    Words list;
    for (int i = 0; i < count; ++i)
      list.push_back(static_cast<std::uint16_t>(word(frame, from + 2 * static_cast<std::size_t>(i))));
    return list;
  }

  int write(int first, const Words& list) {
    if (!inside(first, static_cast<int>(list.size()), 16, 19)) return 2;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const int address = first + static_cast<int>(i);
      if (address == 17 && list[i] > 1) return 3;
      if (address == 18 && (list[i] == 0 || list[i] > 10'000)) return 3;
    }
    for (std::size_t i = 0; i < list.size(); ++i) {
      const int address = first + static_cast<int>(i);
      if (address == 16) voltage_mv_ = static_cast<std::int16_t>(list[i]);
      if (address == 17) enabled_ = list[i] == 1;
      if (address == 17 && list[i] == 0) voltage_mv_ = 0;
      if (address == 18) watchdog_ms_ = list[i];
      shortest_watchdog_ms_ = std::min(shortest_watchdog_ms_, watchdog_in_use_ms());
    }
    return 0;
  }

  int voltage_mv_ = 0, watchdog_ms_ = 0, shortest_watchdog_ms_ = 0;
  bool enabled_ = false;
  double fed_s_ = -1.0;
};

class Stream {
 public:
  explicit Stream(std::uint64_t seed) : random_(seed) {}

  int below(int end) { return std::uniform_int_distribution<>(0, end - 1)(random_); }
  bool one_in(int count) { return below(count) == 0; }

  /// Right requests, wrong ones, or bytes of no sense.
  Bytes burst(int parts) {
    Bytes bytes;
    for (int i = parts; i > 0; --i) {
      Bytes part = one_in(6) ? garbage(1 + below(40)) : request();
      if (one_in(3)) spoil(part);
      bytes.insert(bytes.end(), part.begin(), part.end());
    }
    return bytes;
  }

 private:
  std::uint16_t value() {
    static constexpr std::array<int, 6> edges = {0, 1, 2, 0x7fff, 0x8000, 0xffff};
    return static_cast<std::uint16_t>(one_in(4) ? edges.at(static_cast<std::size_t>(below(6)))
                                                : below(65536));
  }
  Words values(int count) {
    Words words;
    for (int i = 0; i < count; ++i)
      words.push_back(one_in(3) ? static_cast<std::uint16_t>(below(2)) : value());
    return words;
  }
  int address() { return one_in(8) ? value() : below(20); }
  int writable() { return one_in(8) ? address() : 16 + below(3); }

  Bytes request() {
    switch (below(8)) {
      case 0:
        return reading(3 + below(2), address(), one_in(5) ? value() : 1 + below(9));
      case 1:
        return writing_one(writable(), value());
      case 2:
        return writing(writable(), values(1 + below(3)));
      case 3:
        return writing(17, {1});
      case 4:
        return writing(18, {static_cast<std::uint16_t>(20 + below(400))});
      case 5:
        return framed(odd());
      default:
        return exchanging(0, 1 + below(9), writable(), values(1 + below(2)));
    }
  }
  /// A right check sum over anything.
  Bytes odd() {
    Bytes bytes = garbage(2 + below(24));
    if (!one_in(4)) bytes[0] = 1;
    static constexpr std::array<std::uint8_t, 6> functions = {3, 4, 6, 0x10, 0x17, 0x2b};
    if (!one_in(4)) bytes[1] = functions.at(static_cast<std::size_t>(below(6)));
    return bytes;
  }
  Bytes garbage(int size) {
    Bytes bytes(static_cast<std::size_t>(size));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(below(256));
    return bytes;
  }
  void spoil(Bytes& bytes) {
    const auto place = bytes.begin() + below(static_cast<int>(bytes.size()));
    switch (below(4)) {
      case 0:
        *place ^= static_cast<std::uint8_t>(1 << below(8));
        return;
      case 1:
        bytes.erase(place, bytes.end());
        return;
      case 2:
        bytes.insert(place, static_cast<std::uint8_t>(below(256)));
        return;
      default:
        *place = static_cast<std::uint8_t>(below(256));
    }
  }

  std::mt19937_64 random_;
};

class Fuzzed {
 public:
  explicit Fuzzed(std::uint64_t seed) : stream_(seed) {
    board_.on_byte([this](std::uint8_t byte) { replies_.push_back(byte); });
    board_.run_for(0.02);
  }

  double now_s() const { return board_.now_s(); }
  int bursts = 0, answers = 0;

  /// False: a difference was found, and said.
  bool step() {
    ++bursts;
    move_shafts();
    // Within several requests at once a short watchdog may expire, and nobody outside can tell between which.
    const bool can_be_several = account_.watchdog_in_use_ms() >= shortest_told_ms;
    const Bytes bytes = can_be_several && stream_.one_in(8) ? several() : stream_.burst(1);
    const std::pair<std::int64_t, std::int64_t> before = counts();
    replies_.clear();
    board_.send(bytes);
    const double sent_s = now_s();
    while (board_.line_is_busy()) board_.run_until(board_.now() + Board::byte_cycles);
    const double came_s = now_s();
    const double silence_s = 1.1e-3, replies_s = 1e-3 * (stream_.one_in(20) ? 60 : 2);
    board_.run_for(silence_s + replies_s);
    // The watchdog may have expired between two requests of one burst: then nothing is said of this one.
    const bool doubtful = near(account_.expires_s(), sent_s - 1e-3, came_s + 1e-3);
    const std::vector<Account::Answer> expected = account_.take(bytes, came_s);
    answers += static_cast<int>(expected.size());
    return right_replies(bytes, expected, before, doubtful) && right_voltage(bytes);
  }

 private:
  static constexpr int shortest_told_ms = 20;

  Bytes several() {
    Bytes bytes;
    Account trial = account_;
    do {
      bytes = stream_.burst(3);
      trial = account_;
      trial.take(bytes, now_s());
    } while (trial.shortest_watchdog_ms() < shortest_told_ms);
    return bytes;
  }

  static bool near(double time_s, double from_s, double to_s) { return time_s > from_s && time_s < to_s; }
  std::pair<std::int64_t, std::int64_t> counts() const {
    return {board_.counts(Encoder::cart), board_.counts(Encoder::pendulum)};
  }

  void move_shafts() {
    if (!stream_.one_in(4)) return;
    for (const Encoder encoder : {Encoder::cart, Encoder::pendulum})
      board_.turn_to(encoder, board_.counts(encoder) + stream_.below(2001) - 1000,
                     Board::hz / static_cast<Board::Cycles>(1'000 + stream_.below(90'000)));
  }

  bool fail(const Bytes& bytes, const std::string& what) const {
    std::string text;
    for (const std::uint8_t byte : bytes) text += " " + std::to_string(byte);
    ADD_FAILURE() << what << " after" << text << " at " << now_s() << " s";
    return false;
  }

  bool right_replies(const Bytes& bytes, const std::vector<Account::Answer>& expected,
                     const std::pair<std::int64_t, std::int64_t>& before, bool doubtful) {
    std::size_t place = 0;
    for (const Account::Answer& answer : expected) {
      const std::size_t size = answer.read.empty() ? answer.reply.size() : 5 + 2 * answer.read.size();
      if (replies_.size() < place + size) return fail(bytes, "a reply is missing");
      const Bytes reply(replies_.begin() + static_cast<std::ptrdiff_t>(place),
                        replies_.begin() + static_cast<std::ptrdiff_t>(place + size));
      place += size;
      if (answer.read.empty()) {
        if (reply != answer.reply) return fail(bytes, "another reply");
        continue;
      }
      const auto words = words_in(reply);
      if (!words || !std::equal(answer.reply.begin(), answer.reply.end(), reply.begin()))
        return fail(bytes, "another reply to a reading");
      if (!right_words(*words, answer.read, before, doubtful || expected.size() > 1))
        return fail(bytes, "wrong registers");
    }
    return place == replies_.size() || fail(bytes, "a reply that nobody asked for");
  }

  static bool between(std::int64_t count, std::int64_t one, std::int64_t other) {
    return count >= std::min(one, other) - 2 && count <= std::max(one, other) + 2;
  }

  bool right_words(const Words& words, const std::vector<int>& read,
                   const std::pair<std::int64_t, std::int64_t>& before, bool doubtful) const {
    constexpr std::uint16_t watchdog_expired = 16;
    for (std::size_t i = 0; i < words.size(); ++i) {
      const bool pair = i + 1 < words.size();
      const auto count =
          pair ? static_cast<std::int32_t>(static_cast<std::uint32_t>(words[i]) << 16 | words[i + 1]) : 0;
      if (read[i] == 0 && pair && !between(count, before.first, counts().first)) return false;
      if (read[i] == 2 && pair && !between(count, before.second, counts().second)) return false;
      if (read[i] == 4 && words[i] != 1) return false;
      if (read[i] == 5 && (words[i] & ~watchdog_expired) != 0) return false;
      if (read[i] == 7 && words[i] != 12'000) return false;
      if (read[i] >= 16 && !doubtful && words[i] != account_.value(read[i])) return false;
    }
    return true;
  }

  /// On the pins, over whole periods.
  bool right_voltage(const Bytes& bytes) {
    // The emulator moves a pin between two instructions: a pulse is known to some twelve cycles of 800.
    constexpr double margin_s = 2e-3, accuracy_v = 0.18;
    board_.mean_v();
    const double from_s = now_s();
    board_.run_until(board_.now() + 4 * Board::pwm_cycles);
    const double seen_v = board_.mean_v();
    if (near(account_.expires_s(), from_s - margin_s, now_s() + margin_s)) return true;
    account_.expire(now_s());
    if (std::abs(seen_v - account_.voltage_v()) < accuracy_v) return true;
    return fail(bytes, std::to_string(seen_v) + " V instead of " + std::to_string(account_.voltage_v()));
  }

  Stream stream_;
  Board board_{uno_pins()};
  Account account_;
  Bytes replies_;
};

TEST(BoardFuzz, NeverAWrongCountNorAnUnintendedVoltage) {
  const double duration_s = number_of("UPRIGHT_FUZZ_S", 15.0);
  Fuzzed fuzzed(static_cast<std::uint64_t>(number_of("UPRIGHT_SEED", 1)));
  const auto begun = std::chrono::steady_clock::now();
  while (fuzzed.now_s() < duration_s && fuzzed.step()) {
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  std::printf("%.0f s of the board's time in %.0f s: %d bursts, %d requests answered\n", fuzzed.now_s(),
              took.count(), fuzzed.bursts, fuzzed.answers);
  EXPECT_GT(fuzzed.answers, fuzzed.bursts / 4);
}

}  // namespace
}  // namespace upright::test
