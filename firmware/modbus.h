// Modbus RTU device on the serial line of the board.
#pragma once

#include <stdint.h>

void modbus_begin(void);
/// Reads the received bytes, answers a complete request, and sends the next byte of a reply.
void modbus_serve(uint8_t elapsed_ticks);
/// A sample is due: answers a request that waits for it.
void modbus_sample(void);
