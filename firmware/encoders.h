// Two quadrature encoders that are counted in quarter periods, in 32 bits.
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef struct {
  uint32_t cart;
  uint32_t pendulum;
} counts_t;

void encoders_begin(void);
/// Both encoders at the same moment. To be called at least every quarter of a second, for the sampler counts in 16 bits.
counts_t encoders_latch(void);
/// True, until the next reset: edges came faster than they are sampled, and the counts are wrong.
bool encoders_lost_edges(void);
