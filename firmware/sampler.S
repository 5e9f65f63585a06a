; The only interrupt of the firmware, every CYCLES_PER_SAMPLE cycles. It samples the four encoder lines at once, counts,
; and reads a byte from the serial line if there is one. It is in assembler because it runs 125,000 times per second.
#define __SFR_OFFSET 0
#include "board.h"

; Bits of one encoder in an entry of the table.
#define MOVED 1
#define DOWN 2
#define PENDULUM_SHIFT 2
#define SKIPPED_BIT 7

; The step of each encoder from the previous sample to the present one, indexed by (before << 4 | now).
; With B as the upper bit, the lines run through 0, 1, 3, 2 when the shaft turns up, and n ^ n >> 1 is the position.
  .section .progmem.data.steps, "a", @progbits
  .balign 256
steps:
  .macro step before, now
    .set place, (((\now) ^ ((\now) >> 1)) - ((\before) ^ ((\before) >> 1))) & 3
    .if place == 1
      .set code, MOVED
    .elseif place == 3
      .set code, MOVED | DOWN
    .elseif place == 2
      .set code, 1 << SKIPPED_BIT
    .else
      .set code, 0
    .endif
  .endm
  .set index, 0
  .rept 256
    step ((index >> 4) & 3), (index & 3)
    .set cart, code
    step ((index >> 6) & 3), ((index >> 2) & 3)
    .set pendulum, code
    .byte cart | (pendulum & (1 << SKIPPED_BIT)) | ((pendulum & (MOVED | DOWN)) << PENDULUM_SHIFT)
    .set index, index + 1
  .endr

; Ring of the received bytes. It fills an aligned page of 256 bytes, so the lower half of the address is the position.
  .section .bss.received, "aw", @nobits
  .balign 256
  .global received
received:
  .space 256

  .section .bss
  .global received_head
received_head:
  .space 1
  .global line_errors
line_errors:              ; not zero: a byte had a framing error, or was lost because the buffer was full
  .space 1
  .global cart_high
cart_high:
  .space 1
  .global pendulum_high
pendulum_high:
  .space 1
  .global edges_lost
edges_lost:               ; not zero: an encoder moved by two counts between two samples, in an unknown direction
  .space 1

  .section .text
  .global TIMER2_COMPA_vect
TIMER2_COMPA_vect:
  push r24
  in r24, SREG
  push r24
  in r24, ENCODER_PIN
  push r30
  push r31
  in r30, LAST_LINES
  andi r24, 0x0f
  or r30, r24
  swap r24
  out LAST_LINES, r24
  ldi r31, hi8(steps)
  lpm r24, Z
  tst r24
  breq receive
  sbrc r24, SKIPPED_BIT
  sts edges_lost, r24
  sbrs r24, 0
  rjmp count_pendulum
  in r30, CART_LOW
  sbrc r24, 1
  rjmp cart_down
  inc r30
  out CART_LOW, r30
  brne count_pendulum
  lds r30, cart_high
  inc r30
  sts cart_high, r30
  rjmp count_pendulum
cart_down:
  subi r30, 1
  out CART_LOW, r30
  brcc count_pendulum
  lds r30, cart_high
  dec r30
  sts cart_high, r30
count_pendulum:
  sbrs r24, PENDULUM_SHIFT
  rjmp receive
  in r30, PENDULUM_LOW
  sbrc r24, PENDULUM_SHIFT + 1
  rjmp pendulum_down
  inc r30
  out PENDULUM_LOW, r30
  brne receive
  lds r30, pendulum_high
  inc r30
  sts pendulum_high, r30
  rjmp receive
pendulum_down:
  subi r30, 1
  out PENDULUM_LOW, r30
  brcc receive
  lds r30, pendulum_high
  dec r30
  sts pendulum_high, r30

receive:
  lds r24, UCSR0A
  sbrs r24, RXC0
  rjmp done
  andi r24, 1 << FE0 | 1 << DOR0 | 1 << UPE0
  breq take
  sts line_errors, r24
take:
  lds r24, UDR0
  lds r30, received_head
  ldi r31, hi8(received)
  st Z, r24
  inc r30
  sts received_head, r30
done:
  pop r31
  pop r30
  pop r24
  out SREG, r24
  pop r24
  reti
