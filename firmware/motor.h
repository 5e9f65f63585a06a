// The voltage that the bridge gives the motor: PWM at 20 kHz, a direction, and the bridge's enable.
#pragma once

#include <stdbool.h>
#include <stdint.h>

void motor_begin(void);
/// In millivolts; what the supply does not give is clamped.
void motor_drive(int16_t millivolts);
/// The enable line, and the board's own lamp.
void motor_enable(bool on);
/// Zero volts and not enabled, within microseconds.
void motor_off(void);
