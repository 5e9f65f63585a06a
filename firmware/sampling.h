// Samples that the board takes on its own time, so that a controller can follow the board's clock.
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define SHORTEST_SAMPLE_PERIOD_US 500

/// The time between samples from now on; 0: none are taken.
void sampling_set_period(uint16_t period_us);
uint16_t sampling_period_us(void);
/// The number of samples that were due since the period was set; it starts again from 0 after 65535.
uint16_t sampling_number(void);
/// Whether a sample is due now. Call it once in each pass of the main loop, with the time since the last
/// pass.
bool sampling_is_due(uint8_t elapsed_steps);
