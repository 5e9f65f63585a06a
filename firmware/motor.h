// Controls the motor voltage through the bridge: PWM at 20 kHz, direction and enable.
#pragma once

#include <stdbool.h>
#include <stdint.h>

void motor_begin(void);
/// In millivolts, clamped to the supply voltage.
void motor_drive(int16_t millivolts);
/// Sets the enable line and the LED of the board.
void motor_enable(bool on);
/// Sets zero volts and disables the bridge, within microseconds.
void motor_off(void);
