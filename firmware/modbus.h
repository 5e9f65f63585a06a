// Modbus RTU on the board's serial line, as a device.
#pragma once

#include <stdint.h>

void modbus_begin(void);
/// Takes what has come, answers a request when it is whole, and puts out the next byte of a reply.
void modbus_serve(uint8_t elapsed_ticks);
