// Time in ticks of 64 us, from timer 0.
#pragma once

#include <stdint.h>

#include "board.h"

#define TICKS_PER_S (F_CPU / 1024)
/// The number of ticks in these microseconds, rounded up.
#define TICKS(us) (uint16_t)(((us) * (TICKS_PER_S / 25) + 39999) / 40000)

static inline void clock_begin(void) {
  TCCR0A = 0;
  TCCR0B = 1 << CS02 | 1 << CS00;
}

static inline uint8_t clock_now(void) {
  return TCNT0;
}
