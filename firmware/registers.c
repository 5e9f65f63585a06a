#include "registers.h"

#include "board.h"
#include "clock.h"
#include "encoders.h"
#include "motor.h"
#include "sampling.h"

#define VERSION 0x0101
#define DEFAULT_WATCHDOG_MS 100
#define LONGEST_WATCHDOG_MS 10000
#define STOP_INPUTS (STATUS_EMERGENCY_STOP | STATUS_PLUS_SWITCH | STATUS_MINUS_SWITCH)

static counts_t latched;
static uint16_t boot_count, sequence;
static int16_t voltage_mv;
static bool enabled;
static uint16_t watchdog_ms;  // 0 after a reset: not set yet, so the default applies
static uint32_t ticks_left;
static uint8_t status;  // causes that remain until the motor is disabled, or until a reset
// Inputs that were active in every sample of this tick, and of the whole previous tick; in both ticks.
static uint8_t steady, steady_before, pressed;

/// The active stop inputs, as status bits. A switch opens when pressed, and a pull-up then makes the line high.
static uint8_t active_inputs(void) {
  const uint8_t lines = STOP_PIN;
  uint8_t active = 0;
  if (lines & 1 << EMERGENCY_STOP_BIT) active |= STATUS_EMERGENCY_STOP;
  if (lines & 1 << PLUS_SWITCH_BIT) active |= STATUS_PLUS_SWITCH;
  if (lines & 1 << MINUS_SWITCH_BIT) active |= STATUS_MINUS_SWITCH;
  return active;
}

void registers_begin(uint16_t boots) {
  boot_count = boots;
  STOP_PORT |= 1 << EMERGENCY_STOP_BIT | 1 << PLUS_SWITCH_BIT | 1 << MINUS_SWITCH_BIT;
}

void registers_latch(void) {
  latched = encoders_latch();
  ++sequence;
}

static bool within(uint16_t first, uint16_t count, uint16_t begin, uint16_t end) {
  return first >= begin && first < end && count <= end - first;
}

exception_t registers_readable(uint16_t first, uint16_t count) {
  if (within(first, count, REGISTER_VOLTAGE, WRITABLE_END)) return NO_EXCEPTION;
  const uint16_t end = sampling_period_us() != 0 ? READABLE_END : REGISTER_SAMPLE;
  if (!within(first, count, REGISTER_CART, end)) return ILLEGAL_ADDRESS;
  return first < REGISTER_BOOT_COUNT && encoders_lost_edges() ? DEVICE_FAILURE : NO_EXCEPTION;
}

bool registers_wait(uint16_t first, uint16_t count) {
  return registers_readable(first, count) == NO_EXCEPTION && first <= REGISTER_SAMPLE &&
         first + count > REGISTER_SAMPLE;
}

static uint16_t word_at(const uint8_t *bytes) {
  return (uint16_t)(bytes[0] << 8 | bytes[1]);
}

exception_t registers_writable(uint16_t first, uint16_t count, const uint8_t *bytes) {
  if (!within(first, count, REGISTER_VOLTAGE, WRITABLE_END)) return ILLEGAL_ADDRESS;
  for (uint16_t i = 0; i < count; ++i) {
    const uint16_t word = word_at(bytes + 2 * i);
    if (first + i == REGISTER_ENABLE && word > 1) return ILLEGAL_VALUE;
    if (first + i == REGISTER_WATCHDOG && (word == 0 || word > LONGEST_WATCHDOG_MS)) return ILLEGAL_VALUE;
    if (first + i == REGISTER_SAMPLE_PERIOD && word != 0 && word < SHORTEST_SAMPLE_PERIOD_US) return ILLEGAL_VALUE;
  }
  return NO_EXCEPTION;
}

uint16_t registers_read(uint16_t address) {
  switch (address) {
    case REGISTER_CART:
      return (uint16_t)(latched.cart >> 16);
    case REGISTER_CART + 1:
      return (uint16_t)latched.cart;
    case REGISTER_PENDULUM:
      return (uint16_t)(latched.pendulum >> 16);
    case REGISTER_PENDULUM + 1:
      return (uint16_t)latched.pendulum;
    case REGISTER_BOOT_COUNT:
      return boot_count;
    case REGISTER_STATUS:
      return status | pressed;
    case REGISTER_SEQUENCE:
      return sequence;
    case REGISTER_SUPPLY:
      return SUPPLY_MV;
    case REGISTER_VERSION:
      return VERSION;
    case REGISTER_SAMPLE:
      return sampling_number();
    case REGISTER_VOLTAGE:
      return (uint16_t)voltage_mv;
    case REGISTER_ENABLE:
      return enabled;
    case REGISTER_WATCHDOG:
      return watchdog_ms;
    case REGISTER_SAMPLE_PERIOD:
      return sampling_period_us();
  }
  return 0;
}

static void drive(void) {
  if (!enabled) {
    motor_off();
    return;
  }
  motor_drive(voltage_mv);
  motor_enable(true);
}

/// Disabling clears the causes of a stop. Only a reset clears lost edges.
static void set_enabled(uint16_t word) {
  if (word == 0) {
    status &= STATUS_EDGES_LOST;
    voltage_mv = 0;
  }
  enabled = word != 0 && ((status | active_inputs()) & (STOP_INPUTS | STATUS_EDGES_LOST)) == 0;
}

void registers_write(uint16_t first, uint16_t count, const uint8_t *bytes) {
  for (uint16_t i = 0; i < count; ++i) {
    const uint16_t word = word_at(bytes + 2 * i);
    if (first + i == REGISTER_VOLTAGE) voltage_mv = (int16_t)word;
    if (first + i == REGISTER_ENABLE) set_enabled(word);
    if (first + i == REGISTER_WATCHDOG) watchdog_ms = word;
    if (first + i == REGISTER_SAMPLE_PERIOD) sampling_set_period(word);
  }
  drive();
}

void registers_feed(void) {
  ticks_left = (uint32_t)(watchdog_ms != 0 ? watchdog_ms : DEFAULT_WATCHDOG_MS) * (TICKS_PER_S / 125) / 8;
}

static void stop(uint8_t causes) {
  status |= causes;
  voltage_mv = 0;
  enabled = false;
  motor_off();
}

static void watch_inputs(uint8_t elapsed_ticks) {
  const uint8_t active = active_inputs();
  steady &= active;
  if (elapsed_ticks == 0) return;
  pressed = steady & steady_before;
  steady_before = steady;
  steady = active;
  // While the motor is disabled the status shows what is pressed now, so that the switches can be tested.
  if (pressed && enabled) stop(pressed);
}

static void watch_requests(uint8_t elapsed_ticks) {
  ticks_left = ticks_left > elapsed_ticks ? ticks_left - elapsed_ticks : 0;
  if (ticks_left != 0 || voltage_mv == 0) return;
  status |= STATUS_WATCHDOG;
  voltage_mv = 0;
  motor_drive(0);
}

void registers_watch(uint8_t elapsed_ticks) {
  watch_inputs(elapsed_ticks);
  if (elapsed_ticks == 0) return;
  encoders_latch();
  if (encoders_lost_edges() && (status & STATUS_EDGES_LOST) == 0) stop(STATUS_EDGES_LOST);
  watch_requests(elapsed_ticks);
}
