#include "encoders.h"

#include <util/atomic.h>

#include "board.h"

extern volatile uint8_t cart_high, pendulum_high, edges_lost;  // written by the sampler

static counts_t counts;

void encoders_begin(void) {
  ENCODER_PORT |= 0x0f;  // pull-ups, for encoders with open collectors
  // The lines rise within microseconds. Counting starts from their levels after that.
  for (uint8_t i = 0; i < 255; ++i) LAST_LINES = (uint8_t)(ENCODER_PIN << 4);
  CART_LOW = PENDULUM_LOW = 0;
  // Timer 2 restarts on its compare match, which triggers the interrupt.
  OCR2A = CYCLES_PER_SAMPLE - 1;
  TCCR2A = 1 << WGM21;
  TCCR2B = 1 << CS20;
  TIMSK2 = 1 << OCIE2A;
}

/// The count that has these lower bits and is nearest to the last one.
static uint32_t extended(uint32_t last, uint16_t low) {
  return last + (uint32_t)(int32_t)(int16_t)(low - (uint16_t)last);
}

counts_t encoders_latch(void) {
  uint8_t cart[2], pendulum[2];
  ATOMIC_BLOCK(ATOMIC_FORCEON) {
    cart[0] = CART_LOW;
    cart[1] = cart_high;
    pendulum[0] = PENDULUM_LOW;
    pendulum[1] = pendulum_high;
  }
  counts.cart = extended(counts.cart, (uint16_t)(cart[0] | cart[1] << 8));
  counts.pendulum = extended(counts.pendulum, (uint16_t)(pendulum[0] | pendulum[1] << 8));
  return counts;
}

bool encoders_lost_edges(void) {
  return edges_lost != 0;
}
