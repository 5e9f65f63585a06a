// The device's register map (docs/how-to/build-a-board.md), and what writing to it does.
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
  READABLE_END = 9,
  REGISTER_VOLTAGE = 16,
  REGISTER_ENABLE = 17,
  REGISTER_WATCHDOG = 18,
  WRITABLE_END = 19
};

// Bits of REGISTER_STATUS.
enum {
  STATUS_EMERGENCY_STOP = 1 << 0,
  STATUS_PLUS_SWITCH = 1 << 1,
  STATUS_MINUS_SWITCH = 1 << 2,
  STATUS_EDGES_LOST = 1 << 3,
  STATUS_WATCHDOG = 1 << 4
};

/// What Modbus calls an exception; NO_EXCEPTION: done.
typedef enum {
  NO_EXCEPTION = 0,
  ILLEGAL_FUNCTION = 1,
  ILLEGAL_ADDRESS = 2,
  ILLEGAL_VALUE = 3,
  DEVICE_FAILURE = 4
} exception_t;

void registers_begin(uint16_t boot_count);
/// Takes the counts, at one moment, for the reads that follow.
void registers_latch(void);
/// Whether all of them can be read now, or written. Nothing has happened yet.
exception_t registers_readable(uint16_t first, uint16_t count);
exception_t registers_writable(uint16_t first, uint16_t count, const uint8_t *bytes);
uint16_t registers_read(uint16_t address);
/// Bytes as they travel, the high one first; all of them take effect together.
void registers_write(uint16_t first, uint16_t count, const uint8_t *bytes);
/// A valid request came: the watchdog begins anew.
void registers_feed(void);
/// To be called as often as possible: stop inputs, lost edges and the watchdog take the voltage away.
void registers_watch(uint8_t elapsed_ticks);
