// Time in steps of 16 us, from timer 0, and in ticks of 64 us.
#pragma once

#include <stdint.h>

#include "board.h"

#define STEP_US 16
#define STEPS_PER_TICK 4
#define TICKS_PER_S (F_CPU / 1024)
/// The number of ticks in these microseconds, rounded up.
#define TICKS(us) (uint16_t)(((us) * (TICKS_PER_S / 25) + 39999) / 40000)

static inline void clock_begin(void) {
  TCCR0A = 0;
  TCCR0B = 1 << CS02;  // the processor's clock divided by 256
}

/// In steps. It starts again from 0 after 4 ms.
static inline uint8_t clock_now(void) {
  return TCNT0;
}
