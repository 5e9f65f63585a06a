#include "sampling.h"

#include "clock.h"

static uint16_t period_us, number;
static int32_t left_us;  // until the next sample

void sampling_set_period(uint16_t new_period_us) {
  period_us = new_period_us;
  left_us = new_period_us;
  number = 0;
}

uint16_t sampling_period_us(void) {
  return period_us;
}

uint16_t sampling_number(void) {
  return number;
}

bool sampling_is_due(uint8_t elapsed_steps) {
  if (period_us == 0) return false;
  left_us -= (int32_t)elapsed_steps * STEP_US;
  if (left_us > 0) return false;
  // The remainder stays, so that the rate is exact although the steps do not divide the period.
  do {
    left_us += period_us;
    ++number;
  } while (left_us <= 0);
  return true;
}
