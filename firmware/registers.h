// The register map of the device (docs/how-to/build-a-board.md), and the effects of writing to it.
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum {
  REGISTER_CART = 0,      // two registers, the high word first
  REGISTER_PENDULUM = 2,  // two
  REGISTER_BOOT_COUNT = 4,
  REGISTER_STATUS = 5,
  REGISTER_SEQUENCE = 6,
  REGISTER_SUPPLY = 7,
  REGISTER_VERSION = 8,
  REGISTER_SAMPLE = 9,  // a read that includes it is answered with the next sample
  READABLE_END = 10,
  REGISTER_VOLTAGE = 16,
  REGISTER_ENABLE = 17,
  REGISTER_WATCHDOG = 18,
  REGISTER_SAMPLE_PERIOD = 19,
  WRITABLE_END = 20
};

// Bits of REGISTER_STATUS.
enum {
  STATUS_EMERGENCY_STOP = 1 << 0,
  STATUS_PLUS_SWITCH = 1 << 1,
  STATUS_MINUS_SWITCH = 1 << 2,
  STATUS_EDGES_LOST = 1 << 3,
  STATUS_WATCHDOG = 1 << 4
};

/// Modbus exceptions. NO_EXCEPTION: the request was executed.
typedef enum {
  NO_EXCEPTION = 0,
  ILLEGAL_FUNCTION = 1,
  ILLEGAL_ADDRESS = 2,
  ILLEGAL_VALUE = 3,
  DEVICE_FAILURE = 4
} exception_t;

void registers_begin(uint16_t boot_count);
/// Latches both counts at one moment for the following reads.
void registers_latch(void);
/// Whether all these registers can be read now, or written. Changes nothing.
exception_t registers_readable(uint16_t first, uint16_t count);
/// Whether a read of these registers waits for the next sample.
bool registers_wait(uint16_t first, uint16_t count);
exception_t registers_writable(uint16_t first, uint16_t count, const uint8_t *bytes);
uint16_t registers_read(uint16_t address);
/// `bytes` are in the order of the line, high byte first. All registers take effect together.
void registers_write(uint16_t first, uint16_t count, const uint8_t *bytes);
/// Resets the watchdog after a valid request.
void registers_feed(void);
/// Call it as often as possible: stop inputs, lost edges and the watchdog switch the voltage off here.
void registers_watch(uint8_t elapsed_ticks);
