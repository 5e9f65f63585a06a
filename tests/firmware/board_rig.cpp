#include "board_rig.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace upright::test {

namespace {

constexpr std::int64_t slice_ns = 200'000;
constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr double boot_s = 0.02;
constexpr Board::Cycles reply_ends =
    5 * Board::byte_cycles;  // between bytes the board does other things, too

}  // namespace

double BoardWires::motor_v(std::int64_t) {
  // The width is known to the few cycles of an instruction: what differs by less is the same voltage.
  constexpr double same_v = 0.06;
  const double mean_v = board_.mean_v();
  if (mean_v == 0.0 || shown_v_ == 0.0 || std::abs(mean_v - shown_v_) > same_v) shown_v_ = mean_v;
  at_rest_ = shown_v_ == 0.0;
  return shown_v_;
}

/// The shaft's edges, spread over the time until the next call; never as fast as no shaft is, when the plant
/// begins elsewhere than the board.
void BoardWires::follow(Encoder encoder, std::int64_t counts) {
  constexpr Board::Cycles fastest = Board::hz / 100'000;
  const auto edges = static_cast<Board::Cycles>(std::abs(counts - board_.counts(encoder)));
  if (edges > 0) board_.turn_to(encoder, counts, std::max(fastest, period / (edges + 1)));
}

void BoardWires::show(const EncoderCounts& counts) {
  if (mishap_ == Mishap::edges_too_fast) return;
  if (mishap_ != Mishap::cart_sticks) follow(Encoder::cart, counts.cart);
  if (mishap_ != Mishap::pendulum_sticks) follow(Encoder::pendulum, counts.pendulum);
}

void BoardWires::suffer(Mishap mishap) {
  constexpr std::int64_t burst_counts = 1000;
  constexpr Board::Cycles burst_spacing = Board::hz / 200'000;
  mishap_ = mishap;
  switch (mishap) {
    case Mishap::edges_too_fast:
      return board_.turn_to(Encoder::cart, board_.counts(Encoder::cart) + burst_counts, burst_spacing);
    case Mishap::device_restarts:
      return board_.brown_out();
    case Mishap::program_hangs:
      return board_.hang();
    case Mishap::emergency_stop:
      return board_.press(StopInput::emergency, true);
    case Mishap::plus_switch:
      return board_.press(StopInput::plus, true);
    case Mishap::minus_switch:
      return board_.press(StopInput::minus, true);
    default:
      return;
  }
}

BoardRig::BoardRig(const std::string& rig_text, const Pose& start, const std::filesystem::path& trace,
                   const LineFaults& faults)
    : plant_(wires_, rig_text, start, trace), faults_(faults) {
  open_line();
  board_.run_for(boot_s);
  board_.mean_v();
  board_.on_byte([this](std::uint8_t byte) {
    reply_.push_back(byte);
    reply_came_ = board_.now();
  });
  begun_ = board_.now();
  begun_ns_ = MonotonicClock().now_ns();
  plant_.step(begun_ns_);
  thread_.emplace(slice_ns, [this](std::int64_t now_ns) { go_on(now_ns); });
}

BoardRig::~BoardRig() {
  thread_.reset();
  close(far_);
  close(near_);
}

void BoardRig::open_line() {
  near_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  std::array<char, 128> name{};
  if (near_ < 0 || grantpt(near_) != 0 || unlockpt(near_) != 0 ||
      ptsname_r(near_, name.data(), name.size()) != 0)
    throw std::runtime_error("no pseudo-terminal can be had");
  line_ = name.data();
  far_ = ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  tcgetattr(far_, &settings);
  cfmakeraw(&settings);
  tcsetattr(far_, TCSANOW, &settings);
}

/// The board's time follows the machine's; where the machine stood still it catches up.
void BoardRig::go_on(std::int64_t now_ns) {
  constexpr std::int64_t ns_per_1000_cycles = 1000 * ns_per_s / static_cast<std::int64_t>(Board::hz);
  const Board::Cycles until =
      begun_ + static_cast<Board::Cycles>((now_ns - begun_ns_) / ns_per_1000_cycles * 1000);
  while (board_.now() + BoardWires::period <= until) {
    take_request();
    board_.run_until(board_.now() + BoardWires::period);
    plant_.step(begun_ns_ + static_cast<std::int64_t>(board_.now() - begun_) * ns_per_1000_cycles / 1000);
    give_reply();
  }
}

bool BoardRig::hits(int every) {
  return every > 0 && !plant_.held() && std::uniform_int_distribution<>(1, every)(random_) == 1;
}

void BoardRig::break_a_bit(Frame& frame) {
  const std::size_t byte = std::uniform_int_distribution<std::size_t>(0, frame.size() - 1)(random_);
  frame[byte] ^= static_cast<std::uint8_t>(1 << std::uniform_int_distribution<>(0, 7)(random_));
}

BoardRig::Frame BoardRig::noise() {
  Frame bytes(std::uniform_int_distribution<std::size_t>(1, 4)(random_));
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_());
  return bytes;
}

void BoardRig::take_request() {
  Frame request(256);
  const ssize_t size = ::read(near_, request.data(), request.size());
  if (size <= 0 || cut_) return;
  request.resize(static_cast<std::size_t>(size));
  if (hits(faults_.corrupt_requests_every)) break_a_bit(request);
  if (hits(faults_.noise_every)) {
    const Frame disturbing = noise();
    request.insert(request.begin(), disturbing.begin(), disturbing.end());
  }
  board_.send(request);
}

void BoardRig::give_reply() {
  if (!reply_.empty() && board_.now() - reply_came_ > reply_ends) {
    Late reply{board_.now(), std::move(reply_)};
    reply_.clear();
    if (hits(faults_.late_replies_every)) reply.leaves += Board::cycles(faults_.late_s);
    if (hits(faults_.corrupt_replies_every)) break_a_bit(reply.bytes);
    if (hits(faults_.noise_every)) {
      const Frame disturbing = noise();
      reply.bytes.insert(reply.bytes.end(), disturbing.begin(), disturbing.end());
    }
    if (!hits(faults_.drop_replies_every)) leaving_.push_back(std::move(reply));
  }
  while (!leaving_.empty() && leaving_.front().leaves <= board_.now()) {
    const Frame& bytes = leaving_.front().bytes;
    if (!cut_ && ::write(near_, bytes.data(), bytes.size()) < 0)
      throw std::runtime_error("the pseudo-terminal takes nothing");
    leaving_.erase(leaving_.begin());
  }
}

std::vector<TraceRow> BoardRig::record() {
  thread_.reset();
  return plant_.record();
}

}  // namespace upright::test
