// Modbus requests and replies as bytes, by somebody who shares no code with the firmware or the program's
// link.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "board.hpp"

namespace upright::test {

using Bytes = std::vector<std::uint8_t>;
using Words = std::vector<std::uint16_t>;

inline std::uint16_t check_sum(std::span<const std::uint8_t> bytes) {
  std::uint16_t sum = 0xffff;
  for (const std::uint8_t byte : bytes) {
    sum = static_cast<std::uint16_t>(sum ^ byte);
    for (int i = 0; i < 8; ++i)
      sum = static_cast<std::uint16_t>((sum & 1u) != 0 ? (sum >> 1) ^ 0xa001 : sum >> 1);
  }
  return sum;
}

inline Bytes framed(Bytes bytes) {
  const std::uint16_t sum = check_sum(bytes);
  bytes.push_back(static_cast<std::uint8_t>(sum));
  bytes.push_back(static_cast<std::uint8_t>(sum >> 8));
  return bytes;
}

inline void add_word(Bytes& bytes, int word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

inline void add_block(Bytes& bytes, int first, const Words& words) {
  add_word(bytes, first);
  add_word(bytes, static_cast<int>(words.size()));
  bytes.push_back(static_cast<std::uint8_t>(2 * words.size()));
  for (const std::uint16_t word : words) add_word(bytes, word);
}

inline Bytes reading(int function, int first, int count) {
  Bytes bytes = {1, static_cast<std::uint8_t>(function)};
  add_word(bytes, first);
  add_word(bytes, count);
  return framed(bytes);
}

inline Bytes writing(int first, const Words& words) {
  Bytes bytes = {1, 0x10};
  add_block(bytes, first, words);
  return framed(bytes);
}

inline Bytes writing_one(int address, int word) {
  Bytes bytes = {1, 6};
  add_word(bytes, address);
  add_word(bytes, word);
  return framed(bytes);
}

inline Bytes exchanging(int read_first, int read_count, int first, const Words& words) {
  Bytes bytes = {1, 0x17};
  add_word(bytes, read_first);
  add_word(bytes, read_count);
  add_block(bytes, first, words);
  return framed(bytes);
}

inline Bytes refusal(int function, int exception) {
  return framed({1, static_cast<std::uint8_t>(function | 0x80), static_cast<std::uint8_t>(exception)});
}

/// The registers in a reply to a read; none: it is no such reply.
inline std::optional<Words> words_in(const Bytes& reply) {
  if (reply.size() < 5 || reply.size() != 5u + reply[2] || check_sum(reply) != 0) return std::nullopt;
  Words words;
  for (std::size_t i = 3; i + 3 < reply.size(); i += 2)
    words.push_back(static_cast<std::uint16_t>(256u * reply[i] + reply[i + 1]));
  return words;
}

/// Asks a board and waits for its answer, in the board's time.
class ModbusMaster {
 public:
  explicit ModbusMaster(Board& board) : board_(board) {
    board_.on_byte([this](std::uint8_t byte) {
      reply_.push_back(byte);
      came_ = board_.now();
    });
  }

  /// Empty: none within this time after the request.
  Bytes ask(const Bytes& request, double patience_s = 0.002) {
    reply_.clear();
    board_.send(request);
    const Board::Cycles slice = Board::byte_cycles / 2;
    while (board_.line_is_busy()) board_.run_until(board_.now() + slice);
    // Between two bytes of a reply the board does other things, too.
    constexpr Board::Cycles over = 5 * Board::byte_cycles;
    const Board::Cycles until = board_.now() + Board::cycles(patience_s);
    while (board_.now() < until && !(!reply_.empty() && board_.now() - came_ > over))
      board_.run_until(board_.now() + slice);
    return reply_;
  }
  /// When the last byte of the latest reply came.
  double replied_s() const { return static_cast<double>(came_) / Board::hz; }

 private:
  Board& board_;
  Bytes reply_;
  Board::Cycles came_ = 0;
};

}  // namespace upright::test
