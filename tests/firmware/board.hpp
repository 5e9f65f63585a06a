// A board with the compiled firmware in simavr, which executes it instruction by instruction: its pins, its
// serial line, and what can happen to it. Time is the processor's own.
#pragma once

#include <sim_avr.h>

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace upright::test {

/// Which pin of the processor does what: firmware/board.h, said once more by somebody who looks at the pins.
struct BoardPins {
  const char* processor;
  const char* program;  ///< the ELF file
  char encoder_port;    ///< bits 0 to 3: cart A, cart B, pendulum A, pendulum B
  char stop_port;
  std::array<int, 3> stop_bits;  ///< emergency stop, +x, -x
  char pwm_port;
  int pwm_bit;
  char direction_port;
  int direction_bit;
  char enable_port;
  int enable_bit;
};

const BoardPins& uno_pins();
const BoardPins& mega_pins();

enum class Encoder { cart, pendulum };
enum class StopInput { emergency, plus, minus };

class Board {
 public:
  using Cycles = std::uint64_t;
  static constexpr Cycles hz = 16'000'000;
  static constexpr double supply_v = 12.0;
  static constexpr int baud = 500'000;
  static constexpr Cycles byte_cycles = 10 * hz / baud;  ///< start, eight bits, stop
  static constexpr Cycles pwm_cycles = 800;

  static constexpr Cycles cycles(double seconds) { return static_cast<Cycles>(seconds * hz); }

  /// Switched on with its stop inputs wired and at rest.
  explicit Board(const BoardPins& pins);
  ~Board();
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  Cycles now() const { return avr_->cycle; }
  double now_s() const { return static_cast<double>(now()) / hz; }
  void run_until(Cycles time);
  void run_for(double seconds) { run_until(now() + cycles(seconds)); }

  /// Steps of the encoder one after the other, `spacing` apart, from the next one on.
  void turn_to(Encoder encoder, std::int64_t counts, Cycles spacing);
  std::int64_t counts(Encoder encoder) const { return shaft(encoder).counts; }
  /// Lines of one encoder as noise puts them: not where the shaft is.
  void put_lines(Encoder encoder, int quarter);

  void press(StopInput input, bool pressed);

  /// Bytes at the line's rate, after those that are still on their way.
  void send(std::span<const std::uint8_t> bytes);
  bool line_is_busy() const { return !incoming_.empty(); }
  /// Called with every byte of the board's, when it has left.
  void on_byte(std::function<void(std::uint8_t)> listener) { listener_ = std::move(listener); }

  /// The mean voltage since the last call, as the pins give it to a bridge.
  double mean_v();
  /// When the bridge last got a voltage that was not zero; 0: never.
  Cycles last_on() const;

  /// The supply sags: a reset, as the brown-out detector makes it. The EEPROM stays.
  void brown_out();
  /// The program goes astray: it stands in a loop with interrupts off.
  void hang();

 private:
  struct Shaft {
    Board* board = nullptr;
    int first_bit = 0;
    std::int64_t counts = 0, target = 0;
    Cycles spacing = 1;
  };

  struct Watched {
    Board* board = nullptr;
    bool high = false;
  };

  /// A line that something outside the board drives.
  struct Held {
    char port;
    int bit;
    bool high;
  };

  Shaft& shaft(Encoder encoder) { return shafts_[static_cast<std::size_t>(encoder)]; }
  const Shaft& shaft(Encoder encoder) const { return shafts_[static_cast<std::size_t>(encoder)]; }
  avr_irq_t* pin(char port, int bit) const;
  void hold(char port, int bit, bool high);
  void pull(const Shaft& shaft, int quarter);
  void watch(Watched& watched, char port, int bit);
  void note();
  double bridge_v() const;
  void after_reset();
  static void note_reset(avr_t* avr);
  static void width_changed(avr_irq_t* irq, std::uint32_t value, void* board);
  static std::uint64_t step(avr_t* avr, std::uint64_t when, void* shaft);
  static std::uint64_t deliver(avr_t* avr, std::uint64_t when, void* board);
  static void pin_changed(avr_irq_t* irq, std::uint32_t value, void* watched);
  static void byte_sent(avr_irq_t* irq, std::uint32_t value, void* board);

  const BoardPins& pins_;
  avr_t* avr_;
  std::array<Shaft, 2> shafts_;
  Watched pwm_, direction_, enable_;
  std::deque<std::uint8_t> incoming_;
  bool delivering_ = false;
  std::function<void(std::uint8_t)> listener_;
  Cycles noted_ = 0, mean_from_ = 0, last_on_ = 0;
  double volt_cycles_ = 0.0;
  std::uint32_t hang_address_ = 0;
  std::vector<Held> held_;
  void (*core_reset_)(avr_t*) = nullptr;
  bool was_reset_ = false;
};

}  // namespace upright::test
