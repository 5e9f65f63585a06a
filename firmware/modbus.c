#include "modbus.h"

#include <stdbool.h>
#include <util/crc16.h>

#include "board.h"
#include "clock.h"
#include "registers.h"

// The function and the length of a request determine its end, so it is answered at once. After a byte that does not
// belong to a request for this unit, bytes are ignored until the line has been silent. An incomplete request is
// discarded after the same silence, which is the longest gap that the standard allows within a frame above 19200 baud.
#define SILENCE_US 750UL
#define LONGEST_FRAME 256
#define ADDRESS_SIZE 1
#define CHECK_SIZE 2
#define EXCEPTION_BIT 0x80
#define NOT_KNOWN_YET 0
#define UNTIL_SILENCE 0xffff

enum { READ_HOLDING = 0x03, READ_INPUT = 0x04, WRITE_SINGLE = 0x06, WRITE_MULTIPLE = 0x10, READ_WRITE = 0x17 };

extern volatile uint8_t received[], received_head, line_errors;  // written by the sampler

static uint8_t frame[LONGEST_FRAME];
static uint16_t frame_size;
static uint16_t check;  // CRC of the bytes in the frame
static bool deaf;       // bytes are ignored until the line is silent
static uint8_t taken;   // read position in the ring
static uint16_t quiet_ticks;

static uint8_t reply[ADDRESS_SIZE + 2 + 2 * READABLE_END + CHECK_SIZE];
static uint8_t reply_size, reply_sent;

// A read that is answered with the next sample. A further byte on the line means that the master no longer waits.
static bool is_waiting;
static uint8_t waiting_function;
static uint16_t waiting_first, waiting_count;

static void begin_frame(void) {
  frame_size = 0;
  check = 0xffff;
}

void modbus_begin(void) {
  begin_frame();
  UCSR0A = 1 << U2X0;
  UBRR0 = F_CPU / (8L * BAUD) - 1;
  UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
  UCSR0B = 1 << RXEN0 | 1 << TXEN0;
}

static uint16_t word_at(uint16_t place) {
  return (uint16_t)(frame[place] << 8 | frame[place + 1]);
}

static void begin_reply(uint8_t function) {
  reply[0] = UNIT;
  reply[1] = function;
  reply_size = 2;
}

static void add(uint8_t byte) {
  reply[reply_size++] = byte;
}

static void send_reply(void) {
  uint16_t sum = 0xffff;
  for (uint8_t i = 0; i < reply_size; ++i) sum = _crc16_update(sum, reply[i]);
  add((uint8_t)sum);
  add((uint8_t)(sum >> 8));
  reply_sent = 0;
}

static void add_registers(uint16_t first, uint16_t count) {
  add((uint8_t)(2 * count));
  for (uint16_t i = 0; i < count; ++i) {
    const uint16_t word = registers_read(first + i);
    add((uint8_t)(word >> 8));
    add((uint8_t)word);
  }
}

static exception_t read_now(uint8_t function, uint16_t first, uint16_t count) {
  registers_latch();  // first, so that edges lost before the request are detected
  const exception_t problem = registers_readable(first, count);
  if (problem != NO_EXCEPTION) return problem;
  begin_reply(function);
  add_registers(first, count);
  return NO_EXCEPTION;
}

static exception_t read(uint8_t function) {
  const uint16_t first = word_at(2), count = word_at(4);
  if (count == 0) return ILLEGAL_VALUE;
  if (!registers_wait(first, count)) return read_now(function, first, count);
  is_waiting = true;
  waiting_function = function;
  waiting_first = first;
  waiting_count = count;
  return NO_EXCEPTION;
}

/// The reply repeats the address and the quantity, or the value, of the request.
static void repeat_request(void) {
  begin_reply(frame[1]);
  for (uint8_t i = 2; i < 6; ++i) add(frame[i]);
}

static exception_t write_single(void) {
  const exception_t problem = registers_writable(word_at(2), 1, frame + 4);
  if (problem != NO_EXCEPTION) return problem;
  registers_write(word_at(2), 1, frame + 4);
  repeat_request();
  return NO_EXCEPTION;
}

static exception_t write_multiple(void) {
  const uint16_t first = word_at(2), count = word_at(4);
  if (count == 0 || count > LONGEST_FRAME / 2 || frame[6] != 2 * count) return ILLEGAL_VALUE;
  const exception_t problem = registers_writable(first, count, frame + 7);
  if (problem != NO_EXCEPTION) return problem;
  registers_write(first, count, frame + 7);
  repeat_request();
  return NO_EXCEPTION;
}

/// Writes first, as the standard requires, but only if both the write and the read are possible.
static exception_t read_write(void) {
  const uint16_t first = word_at(6), count = word_at(8);
  if (word_at(4) == 0 || count == 0 || count > LONGEST_FRAME / 2 || frame[10] != 2 * count) return ILLEGAL_VALUE;
  exception_t problem = registers_readable(word_at(2), word_at(4));
  if (problem == NO_EXCEPTION) problem = registers_writable(first, count, frame + 11);
  // A request that waits for a sample must not change when samples are taken.
  if (problem == NO_EXCEPTION && registers_wait(word_at(2), word_at(4)) && first + count > REGISTER_SAMPLE_PERIOD)
    problem = ILLEGAL_VALUE;
  if (problem != NO_EXCEPTION) return problem;
  registers_write(first, count, frame + 11);
  return read(READ_WRITE);
}

static exception_t obey(void) {
  switch (frame[1]) {
    case READ_HOLDING:
    case READ_INPUT:
      return read(frame[1]);
    case WRITE_SINGLE:
      return write_single();
    case WRITE_MULTIPLE:
      return write_multiple();
    case READ_WRITE:
      return read_write();
  }
  return ILLEGAL_FUNCTION;
}

/// Sends the reply that was prepared, or why there is none.
static void finish(uint8_t function, exception_t problem) {
  if (problem != NO_EXCEPTION) {
    begin_reply(function | EXCEPTION_BIT);
    add(problem);
  }
  send_reply();
}

static void answer(void) {
  const exception_t problem = obey();
  if (problem == NO_EXCEPTION) registers_feed();
  if (!is_waiting) finish(frame[1], problem);
}

void modbus_sample(void) {
  if (!is_waiting) return;
  is_waiting = false;
  finish(waiting_function, read_now(waiting_function, waiting_first, waiting_count));
}

/// The size of the frame, from its first bytes. NOT_KNOWN_YET: more bytes are needed. UNTIL_SILENCE: the function is
/// unknown, so the frame ends with a silence.
static uint16_t whole_size(void) {
  if (frame_size < 2) return NOT_KNOWN_YET;
  switch (frame[1]) {
    case READ_HOLDING:
    case READ_INPUT:
    case WRITE_SINGLE:
      return 8;
    case WRITE_MULTIPLE:
      return frame_size < 7 ? NOT_KNOWN_YET : (uint16_t)(7 + frame[6] + CHECK_SIZE);
    case READ_WRITE:
      return frame_size < 11 ? NOT_KNOWN_YET : (uint16_t)(11 + frame[10] + CHECK_SIZE);
  }
  return UNTIL_SILENCE;
}

/// Answers the frame if it is valid: the CRC over a frame that includes its check sum is zero.
static void end_frame(void) {
  if (check == 0 && frame_size >= ADDRESS_SIZE + 1 + CHECK_SIZE)
    answer();
  else
    deaf = true;
  begin_frame();
}

static void take(uint8_t byte) {
  quiet_ticks = 0;
  is_waiting = false;
  if (line_errors) {
    line_errors = 0;
    deaf = true;
  }
  if (deaf) return;
  if (frame_size == LONGEST_FRAME || (frame_size == 0 && byte != UNIT)) {
    deaf = true;
    return;
  }
  frame[frame_size++] = byte;
  check = _crc16_update(check, byte);
  if (frame_size == whole_size()) end_frame();
}

/// A silence also ends a frame with an unknown function.
static void note_silence(void) {
  if (!deaf && frame_size > 0 && whole_size() == UNTIL_SILENCE) end_frame();
  begin_frame();
  deaf = false;
}

static void send(void) {
  if (!(UCSR0A & 1 << UDRE0)) return;
  UDR0 = reply[reply_sent++];
  if (reply_sent == reply_size) reply_size = 0;
}

void modbus_serve(uint8_t elapsed_ticks) {
  if (reply_size != 0) {
    send();
    return;
  }
  if (taken != received_head) {
    take(received[taken++]);
    return;
  }
  if (frame_size == 0 && !deaf) return;
  quiet_ticks += elapsed_ticks;
  if (quiet_ticks > TICKS(SILENCE_US)) note_silence();
}
