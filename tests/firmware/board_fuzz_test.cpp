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

/// When something happened, as far as it can be told from outside.
struct Span {
  double from_s, to_s;
};

/// What the registers of the device hold, by the documentation of its map (docs/how-to/build-a-board.md).
class Account {
 public:
  struct Answer {
    Bytes reply;                         ///< with zeros where the device's own numbers are
    std::vector<int> read;               ///< the addresses in it
    std::vector<std::vector<int>> held;  ///< for each of them what it may have held; empty: not told here
    bool waits = false;                  ///< it comes with the next sample
    bool may_be_dropped = false;         ///< bytes follow the request: the master no longer waits
  };

  /// What has to come of bytes that follow a silence and that a silence follows. The first is whole at
  /// `first_s`.
  std::vector<Answer> take(const Bytes& bytes, double first_s) {
    std::vector<Answer> answers;
    double free_s = first_s;  // the board takes no further bytes while it sends a reply
    std::size_t place = 0;
    while (bytes.size() - place >= 4 && bytes[place] == 1) {
      const Bytes rest(bytes.begin() + static_cast<std::ptrdiff_t>(place), bytes.end());
      const std::size_t size = size_of(rest);
      if (size > longest || size > rest.size()) break;
      const Bytes frame(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(size));
      if (check_sum(frame) != 0) break;
      place += size;
      const double whole_s = first_s + byte_s * static_cast<double>(place - 1);
      const double taken_s = free_s + longest_per_byte_s * static_cast<double>(size);
      const Span obeyed{whole_s, std::max(whole_s, taken_s) + longest_to_obey_s};
      answers.push_back(answer(frame, obeyed));
      answers.back().may_be_dropped = answers.back().waits && place < bytes.size();
      free_s = obeyed.to_s + longest_per_byte_s * static_cast<double>(size_of(answers.back()));
    }
    return answers;
  }

  static constexpr double byte_s = 1.0 / (Board::hz / Board::byte_cycles);
  // It takes or sends a byte per round of its loop, which an interrupt has more than half of.
  static constexpr double longest_per_byte_s = 3 * byte_s;

  /// The bytes of its reply.
  static std::size_t size_of(const Answer& answer) {
    return answer.read.empty() ? answer.reply.size() : 5 + 2 * answer.read.size();
  }

  /// Whether the watchdog may act within the span.
  bool may_expire_in(Span span) const {
    const Span expiry = expires();
    return voltage_mv_ != 0 && span.to_s > expiry.from_s && span.from_s < expiry.to_s;
  }
  /// The watchdog's part of the account, up to some moment within the span.
  void expire(Span span) {
    if (may_expire_in(span)) may_have_expired_ = true;
    if (span.from_s >= expires().to_s) set_voltage(0);
  }
  /// Whether the pins may give this; what they give then tells whether a watchdog in doubt has acted.
  bool agrees(double seen_v, double accuracy_v) {
    const bool driven = std::abs(seen_v - voltage_v()) < accuracy_v, still = std::abs(seen_v) < accuracy_v;
    if (may_have_expired_ && enabled_ && driven != still) {
      if (still) set_voltage(0);
      may_have_expired_ = false;
      return true;
    }
    return driven;
  }
  double sample_period_s() const { return 1e-6 * period_us_; }
  double voltage_v() const {
    return enabled_ ? std::clamp(1e-3 * voltage_mv_, -Board::supply_v, Board::supply_v) : 0.0;
  }

 private:
  static constexpr std::size_t longest = 256;
  // A byte of the line's time, a round of the board's loop, and the check sum of the longest reply.
  static constexpr double longest_to_obey_s = 0.2e-3;
  // The board counts ticks of 64 us: the one that has begun, and a fraction of one, may be missing; it acts a
  // round later.
  static constexpr double earlier_s = 0.15e-3, later_s = 0.1e-3;

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
  bool readable(int first, int count) const {
    return inside(first, count, 0, period_us_ != 0 ? 10 : 9) || inside(first, count, 16, 20);
  }
  bool waits(int first, int count) const {
    return readable(first, count) && inside(9, 1, first, first + count);
  }

  Span expires() const {
    const double watchdog_s = 1e-3 * (watchdog_ms_ != 0 ? watchdog_ms_ : 100);
    return {fed_.from_s + watchdog_s - earlier_s, fed_.to_s + watchdog_s + later_s};
  }
  void set_voltage(int millivolts) {
    voltage_mv_ = millivolts;
    may_have_expired_ = false;
  }
  std::vector<int> held(int address) const {
    if (address == 17) return {int{enabled_}};
    if (address == 18) return {watchdog_ms_};
    if (address == 19) return {period_us_};
    if (address != 16) return {};
    if (may_have_expired_) return {voltage_mv_ & 0xffff, 0};
    return {voltage_mv_ & 0xffff};
  }

  Answer answer(const Bytes& frame, Span obeyed) {
    expire(obeyed);
    const int exception = obey(frame);
    Answer answer;
    if (exception != 0) {
      answer.reply = refusal(frame[1], exception);
      return answer;
    }
    fed_ = obeyed;
    if (frame[1] == 6 || frame[1] == 0x10) {
      answer.reply = framed(Bytes(frame.begin(), frame.begin() + 6));
      return answer;
    }
    answer.waits = waits(word(frame, 2), word(frame, 4));
    answer.reply = {1, frame[1], static_cast<std::uint8_t>(2 * word(frame, 4))};
    for (int i = 0; i < word(frame, 4); ++i) {
      answer.read.push_back(word(frame, 2) + i);
      answer.held.push_back(held(answer.read.back()));
    }
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
        return write(word(frame, 6), words(frame, 11, word(frame, 8)),
                     waits(word(frame, 2), word(frame, 4)) ? 19 : 20);
    }
    return 1;
  }

  static Words words(const Bytes& frame, std::size_t from, int count) {
    Words list;
    for (int i = 0; i < count; ++i)
      list.push_back(static_cast<std::uint16_t>(word(frame, from + 2 * static_cast<std::size_t>(i))));
    return list;
  }

  /// Registers from `value_end` on can be written, and not by this request.
  int write(int first, const Words& list, int value_end = 20) {
    if (!inside(first, static_cast<int>(list.size()), 16, 20)) return 2;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const int address = first + static_cast<int>(i);
      if (address == 17 && list[i] > 1) return 3;
      if (address == 18 && (list[i] == 0 || list[i] > 10'000)) return 3;
      if (address == 19 && list[i] != 0 && list[i] < 500) return 3;
      if (address >= value_end) return 3;
    }
    for (std::size_t i = 0; i < list.size(); ++i) {
      const int address = first + static_cast<int>(i);
      if (address == 16) set_voltage(static_cast<std::int16_t>(list[i]));
      if (address == 17) enabled_ = list[i] == 1;
      if (address == 17 && list[i] == 0) set_voltage(0);
      if (address == 18) watchdog_ms_ = list[i];
      if (address == 19) period_us_ = list[i];
    }
    return 0;
  }

  int voltage_mv_ = 0, watchdog_ms_ = 0, period_us_ = 0;
  bool enabled_ = false;
  bool may_have_expired_ = false;  ///< a request came when the watchdog was about to act: perhaps it has
  Span fed_{-1.0, -1.0};
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
  int address() { return one_in(8) ? value() : below(21); }
  int writable() { return one_in(8) ? address() : 16 + below(4); }

  Bytes request() {
    switch (below(8)) {
      case 0:
        return reading(3 + below(2), address(), one_in(5) ? value() : 1 + below(10));
      case 1:
        return writing_one(writable(), value());
      case 2:
        return writing(writable(), values(1 + below(4)));
      case 3:
        return writing(17, {1});
      case 4:
        return writing(18, {static_cast<std::uint16_t>(20 + below(400))});
      case 5:
        return framed(odd());
      default:
        return exchanging(0, 1 + below(10), writable(), values(1 + below(2)));
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
    board_.on_byte([this](std::uint8_t byte) {
      replies_.push_back(byte);
      last_reply_s_ = now_s();
    });
    board_.run_for(0.02);
  }

  double now_s() const { return board_.now_s(); }
  int bursts = 0, answers = 0;

  /// False: a difference was found, and said.
  bool step() {
    ++bursts;
    move_shafts();
    const Bytes bytes = stream_.burst(stream_.one_in(8) ? 3 : 1);
    const std::pair<std::int64_t, std::int64_t> before = counts();
    replies_.clear();
    const double sent_s = now_s();
    board_.send(bytes);
    while (board_.line_is_busy()) board_.run_until(board_.now() + Board::byte_cycles);
    const double silence_s = 1.1e-3, replies_s = 1e-3 * (stream_.one_in(20) ? 60 : 2);
    // The board takes what follows a request after its reply.
    board_.run_for(silence_s + replies_s + Account::longest_per_byte_s * static_cast<double>(bytes.size()));
    while (now_s() < last_reply_s_ + between_bytes_s) board_.run_for(between_bytes_s);
    const std::vector<Account::Answer> expected = account_.take(bytes, sent_s);
    answers += static_cast<int>(expected.size());
    for (const Account::Answer& answer : expected) {
      // What follows a reply that came after all is read after it.
      if (answer.may_be_dropped) board_.run_for(replies_after_s);
      if (answer.waits && !answer.may_be_dropped) await_reply(sent_s + account_.sample_period_s());
    }
    return right_replies(bytes, expected, before) && right_voltage(bytes);
  }

 private:
  /// Three requests may take longer to answer; between two bytes the board may have one of them to obey.
  static constexpr double between_bytes_s = 1e-3;
  /// The longest burst takes this long behind a reply.
  static constexpr double replies_after_s = 20e-3;

  std::pair<std::int64_t, std::int64_t> counts() const {
    return {board_.counts(Encoder::cart), board_.counts(Encoder::pendulum)};
  }

  /// Of a request that waits for a sample, which comes until then.
  void await_reply(double until_s) {
    const double sent_by_s = std::max(until_s, now_s()) + 2e-3;
    while (now_s() < sent_by_s || now_s() < last_reply_s_ + between_bytes_s) board_.run_for(between_bytes_s);
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
                     const std::pair<std::int64_t, std::int64_t>& before) {
    std::size_t place = 0, certain_size = 0;
    for (const Account::Answer& answer : expected)
      if (!answer.may_be_dropped) certain_size += Account::size_of(answer);
    for (const Account::Answer& answer : expected) {
      const std::size_t size = Account::size_of(answer);
      if (answer.may_be_dropped) {
        if (replies_.size() < place + size + certain_size) continue;
      } else {
        certain_size -= size;
      }
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
      if (!right_words(*words, answer, before)) return fail(bytes, "wrong registers");
    }
    return place == replies_.size() || fail(bytes, "a reply that nobody asked for");
  }

  static bool between(std::int64_t count, std::int64_t one, std::int64_t other) {
    return count >= std::min(one, other) - 2 && count <= std::max(one, other) + 2;
  }

  bool right_words(const Words& words, const Account::Answer& answer,
                   const std::pair<std::int64_t, std::int64_t>& before) const {
    const std::vector<int>& read = answer.read;
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
      const std::vector<int>& held = answer.held[i];
      if (!held.empty() && std::find(held.begin(), held.end(), words[i]) == held.end()) return false;
    }
    return true;
  }

  /// On the pins, over whole periods.
  bool right_voltage(const Bytes& bytes) {
    // The emulator moves a pin between two instructions: a pulse is known to some twelve cycles of 800.
    constexpr double accuracy_v = 0.18;
    board_.mean_v();
    const double from_s = now_s();
    board_.run_until(board_.now() + 4 * Board::pwm_cycles);
    const double seen_v = board_.mean_v();
    const Span looked{from_s, now_s()};
    const bool changes = account_.may_expire_in(looked);
    account_.expire(looked);
    if (changes || account_.agrees(seen_v, accuracy_v)) return true;
    return fail(bytes, std::to_string(seen_v) + " V instead of " + std::to_string(account_.voltage_v()));
  }

  Stream stream_;
  Board board_{uno_pins()};
  Account account_;
  Bytes replies_;
  double last_reply_s_ = 0.0;
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
