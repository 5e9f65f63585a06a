#include "board.hpp"

#include <avr_ioport.h>
#include <avr_timer.h>
#include <avr_uart.h>
#include <sim_elf.h>

#include <algorithm>
#include <cstdarg>
#include <cstdlib>
#include <stdexcept>

namespace upright::test {

namespace {

constexpr char serial_port = '0', pwm_timer = '1';

void be_silent(avr_t*, const int, const char*, std::va_list) {}

/// Where `break; rjmp .-2` would be put: the last words of the flash, that no program uses.
constexpr std::array<std::uint8_t, 4> endless_loop = {0xf8, 0x94, 0xff, 0xcf};  // cli; rjmp .-2

}  // namespace

const BoardPins& uno_pins() {
  static const BoardPins pins = {
      "atmega328p", UPRIGHT_FIRMWARE_DIR "/uno.elf", 'C', 'D', {4, 5, 6}, 'B', 1, 'B', 0, 'D', 7};
  return pins;
}

const BoardPins& mega_pins() {
  static const BoardPins pins = {
      "atmega2560", UPRIGHT_FIRMWARE_DIR "/mega.elf", 'F', 'A', {0, 1, 2}, 'B', 5, 'B', 6, 'B', 4};
  return pins;
}

Board::Board(const BoardPins& pins) : pins_(pins), avr_(avr_make_mcu_by_name(pins.processor)) {
  if (!avr_) throw std::runtime_error(std::string("simavr does not know ") + pins.processor);
  avr_global_logger_set(be_silent);
  elf_firmware_t firmware{};
  if (elf_read_firmware(pins.program, &firmware) != 0)
    throw std::runtime_error(std::string("cannot read ") + pins.program);
  firmware.frequency = hz;
  avr_init(avr_);
  avr_load_firmware(avr_, &firmware);
  hang_address_ = avr_->flashend + 1 - endless_loop.size();
  std::copy(endless_loop.begin(), endless_loop.end(), avr_->flash + hang_address_);
  avr_->codeend = avr_->flashend;
  std::uint32_t flags = 0;  // neither the console nor sleeping for us
  avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS(serial_port), &flags);
  avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_UART_GETIRQ(serial_port), UART_IRQ_OUTPUT), byte_sent,
                          this);
  avr_irq_t* const width = avr_io_getirq(avr_, AVR_IOCTL_TIMER_GETIRQ(pwm_timer), TIMER_IRQ_OUT_PWM0);
  width->flags &= static_cast<std::uint8_t>(~IRQ_FLAG_FILTERED);  // what it compares with may be of long ago
  avr_irq_register_notify(width, width_changed, this);
  avr_->custom.data = this;
  core_reset_ = avr_->reset;
  avr_->reset = note_reset;
  watch(pwm_, pins.pwm_port, pins.pwm_bit);
  watch(direction_, pins.direction_port, pins.direction_bit);
  watch(enable_, pins.enable_port, pins.enable_bit);
  for (const Encoder encoder : {Encoder::cart, Encoder::pendulum}) {
    shaft(encoder).board = this;
    shaft(encoder).first_bit = encoder == Encoder::cart ? 0 : 2;
    pull(shaft(encoder), 0);
  }
  for (const StopInput input : {StopInput::emergency, StopInput::plus, StopInput::minus}) press(input, false);
}

Board::~Board() {
  avr_terminate(avr_);
  std::free(avr_);
}

void Board::run_until(Cycles time) {
  // The core runs to the next timer; this one ends it in time.
  while (avr_->cycle < time) {
    avr_->run_cycle_limit = std::min<Cycles>(time - avr_->cycle, pwm_cycles);
    // The limit counts from the next timer on; until then the core runs on what was left of the call before.
    avr_->run_cycle_count = std::min<Cycles>(avr_->run_cycle_count, time - avr_->cycle);
    const int state = avr_run(avr_);
    if (state == cpu_Crashed || state == cpu_Done) throw std::runtime_error("the firmware has crashed");
    if (was_reset_) after_reset();
  }
}

avr_irq_t* Board::pin(char port, int bit) const {
  return avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ(static_cast<std::uint32_t>(port)), bit);
}

/// Somebody outside holds the line: its own pull-up does not matter.
void Board::hold(char port, int bit, bool high) {
  avr_ioport_t* found = nullptr;
  for (avr_io_t* io = avr_->io_port; io && !found; io = io->next) {
    auto* const candidate = reinterpret_cast<avr_ioport_t*>(io);  // which begins with its avr_io_t
    if (io->kind == std::string("port") && candidate->name == port) found = candidate;
  }
  const auto mask = static_cast<std::uint8_t>(1u << static_cast<unsigned>(bit));
  found->external.pull_mask |= mask;
  found->external.pull_value = static_cast<std::uint8_t>(high ? found->external.pull_value | mask
                                                              : found->external.pull_value & ~mask);
  avr_raise_irq(pin(port, bit), high);
  const auto same = [&](const Held& line) { return line.port == port && line.bit == bit; };
  const auto line = std::find_if(held_.begin(), held_.end(), same);
  if (line == held_.end())
    held_.push_back({port, bit, high});
  else
    line->high = high;
}

void Board::pull(const Shaft& shaft, int quarter) {
  hold(pins_.encoder_port, shaft.first_bit, quarter == 1 || quarter == 2);
  hold(pins_.encoder_port, shaft.first_bit + 1, quarter >= 2);
}

std::uint64_t Board::step(avr_t*, std::uint64_t when, void* parameter) {
  Shaft& shaft = *static_cast<Shaft*>(parameter);
  if (shaft.counts == shaft.target) return 0;
  shaft.counts += shaft.target > shaft.counts ? 1 : -1;
  shaft.board->pull(shaft, static_cast<int>(shaft.counts & 3));
  return shaft.counts == shaft.target ? 0 : when + shaft.spacing;
}

void Board::turn_to(Encoder encoder, std::int64_t counts, Cycles spacing) {
  Shaft& moved = shaft(encoder);
  const bool was_moving = moved.counts != moved.target;
  moved.target = counts;
  moved.spacing = spacing;
  if (moved.counts != counts && !was_moving) avr_cycle_timer_register(avr_, spacing, step, &moved);
}

void Board::put_lines(Encoder encoder, int quarter) {
  pull(shaft(encoder), quarter & 3);
}

void Board::press(StopInput input, bool pressed) {
  // The switch joins the line to ground and opens when pressed; the pull-up makes the line high.
  hold(pins_.stop_port, pins_.stop_bits.at(static_cast<std::size_t>(input)), pressed);
}

std::uint64_t Board::deliver(avr_t* avr, std::uint64_t when, void* parameter) {
  Board& board = *static_cast<Board*>(parameter);
  avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(serial_port), UART_IRQ_INPUT),
                board.incoming_.front());
  board.incoming_.pop_front();
  board.delivering_ = !board.incoming_.empty();
  return board.delivering_ ? when + byte_cycles : 0;
}

void Board::send(std::span<const std::uint8_t> bytes) {
  incoming_.insert(incoming_.end(), bytes.begin(), bytes.end());
  if (delivering_ || incoming_.empty()) return;
  delivering_ = true;
  avr_cycle_timer_register(avr_, 1, deliver, this);
}

void Board::byte_sent(avr_irq_t*, std::uint32_t value, void* parameter) {
  const Board& board = *static_cast<Board*>(parameter);
  if (board.listener_) board.listener_(static_cast<std::uint8_t>(value));
}

/// simavr 1.6 takes an ATmega328P's new width only when the timer is configured anew, which this has it do.
void Board::width_changed(avr_irq_t*, std::uint32_t, void* board) {
  std::uint8_t own_clock = 0;
  avr_ioctl(static_cast<Board*>(board)->avr_, AVR_IOCTL_TIMER_SET_VIRTCLK(pwm_timer), &own_clock);
}

void Board::note_reset(avr_t* avr) {
  auto& board = *static_cast<Board*>(avr->custom.data);
  board.was_reset_ = true;
  if (board.core_reset_) board.core_reset_(avr);
}

void Board::watch(Watched& watched, char port, int bit) {
  watched.board = this;
  avr_irq_register_notify(pin(port, bit), pin_changed, &watched);
}

void Board::pin_changed(avr_irq_t*, std::uint32_t value, void* parameter) {
  Watched& watched = *static_cast<Watched*>(parameter);
  watched.board->note();
  watched.high = (value & 1u) != 0;
}

/// What a bridge of PWM, direction and enable gives the motor now.
double Board::bridge_v() const {
  if (!pwm_.high || !enable_.high) return 0.0;
  return direction_.high ? -supply_v : supply_v;
}

void Board::note() {
  const double voltage_v = bridge_v();
  if (voltage_v != 0.0) last_on_ = now();
  volt_cycles_ += voltage_v * static_cast<double>(now() - noted_);
  noted_ = now();
}

double Board::mean_v() {
  note();
  const Cycles span = now() - mean_from_;
  const double mean = span > 0 ? volt_cycles_ / static_cast<double>(span) : bridge_v();
  volt_cycles_ = 0.0;
  mean_from_ = now();
  return mean;
}

Board::Cycles Board::last_on() const {
  return bridge_v() != 0.0 ? now() : last_on_;
}

void Board::brown_out() {
  avr_reset(avr_);
  after_reset();
}

/// A reset, for whatever cause, ends what simavr had been told to do later, and forgets the levels of its
/// pins.
void Board::after_reset() {
  was_reset_ = false;
  note();
  // No pin drives anything in a reset: the resistors on the bridge's inputs hold them low.
  pwm_.high = direction_.high = enable_.high = false;
  for (const Held& line : held_) {
    avr_raise_irq(pin(line.port, line.bit), !line.high);
    avr_raise_irq(pin(line.port, line.bit), line.high);
  }
  for (Shaft& moved : shafts_)
    if (moved.counts != moved.target) avr_cycle_timer_register(avr_, moved.spacing, step, &moved);
  if (delivering_) avr_cycle_timer_register(avr_, byte_cycles, deliver, this);
}

void Board::hang() {
  avr_->pc = hang_address_;
}

}  // namespace upright::test
