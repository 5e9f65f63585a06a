// Counts two quadrature encoders, four counts per period, in 32 bits.
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef struct {
  uint32_t cart;
  uint32_t pendulum;
} counts_t;

void encoders_begin(void);
/// Both counts at the same moment. Call it at least every quarter of a second, because the sampler counts in 16 bits.
counts_t encoders_latch(void);
/// True until the next reset if edges came faster than the sample rate, so that the counts are wrong.
bool encoders_lost_edges(void);
